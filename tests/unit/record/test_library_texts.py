"""The texts of libraries that a recording's file holds, for a computer that does not have their folders."""

from __future__ import annotations

import io
import shutil
import tempfile
from pathlib import Path

import pytest

from fbvm import Plc, Recording, RecordingWriter, compile_text
from fbvm.code.image import Image
from fbvm.record.recording import library_texts as module
from fbvm.record.recording.file_reader import RecordingFile
from fbvm.record.recording.file_scans import FileScans
from fbvm.record.recording.file_writer import Described
from fbvm.record.recording.library_texts import LibraryTexts, library_texts, unpacked
from fbvm.record.recording.program_text import ProgramText

PROGRAM = "PROGRAM Main VAR two : Doubled; n : INT; END_VAR two(IN := n); n := two.OUT + Step; END_PROGRAM"
DOUBLED = "FUNCTION_BLOCK Doubled VAR_INPUT IN : INT; END_VAR VAR_OUTPUT OUT : INT; END_VAR OUT := 2 * IN; END_FUNCTION_BLOCK\n"
CONSTANTS = "VAR_GLOBAL CONSTANT Step : INT := 3; END_VAR\n"


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with one library; no image of a program with it is known from other runs."""
    monkeypatch.setenv("FBVM_CACHE", str(tmp_path / "cache"))
    folder = tmp_path / "own" / "acme" / "sums"
    folder.mkdir(parents=True)
    (folder / "library.toml").write_text('globals = ["Constants.st"]\n', encoding="utf-8")
    (folder / "Doubled.st").write_text(DOUBLED, encoding="utf-8")
    (folder / "Constants.st").write_text(CONSTANTS, encoding="utf-8")
    (folder / "notes.md").write_text("# not for compilers", encoding="utf-8")
    return tmp_path / "own"


def recorded(own: Path) -> bytes:
    """The file of a recording of ten scans of the program."""
    image = compile_text(PROGRAM, libraries=[own]).image
    assert image is not None
    plc, file = Plc(image), io.BytesIO()
    made = Recording(file=RecordingWriter(file))
    made.add("pump", plc, Described(ProgramText((("text.st", PROGRAM),), (str(own),), library_texts([own]))))
    plc.run(scans=10)
    made.close()
    return file.getvalue()


@pytest.mark.slow
def test_a_recording_opens_where_the_libraries_are_not(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written = recorded(own)
    shutil.rmtree(own)
    for temporary in (None, str(own / "nowhere")):  # the second time from the cache, with no library written out
        monkeypatch.setattr(tempfile, "tempdir", temporary)
        source = FileScans(RecordingFile(io.BytesIO(written))["pump"])
        assert [source.at(scan).read("Main.n") for scan in (0, 1, 9)] == [3, 9, 3069]
        assert source.warning == ""
        assert source.texts["acme/sums/Doubled.st"] == DOUBLED


def test_libraries_that_cannot_be_written_are_a_reason(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = ProgramText((("text.st", PROGRAM),), (str(own),), library_texts([own]))
    monkeypatch.setattr(tempfile, "tempdir", str(own / "nowhere"))
    found = program.compiled()
    assert isinstance(found, str)
    assert found.startswith("the libraries that it holds cannot be written to a temporary folder: ")
    assert isinstance(program.compiled([own]), Image), "a folder that is named takes their place"


def test_what_has_been_changed_since_is_not_looked_at(own: Path) -> None:
    written = recorded(own)
    (own / "acme" / "sums" / "Doubled.st").write_text(DOUBLED.replace("2 * IN", "5 * IN"), encoding="utf-8")
    source = FileScans(RecordingFile(io.BytesIO(written))["pump"])
    assert (source.at(1).read("Main.n"), source.warning) == (9, "")


def test_too_large_libraries_are_asked_for(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_CHARACTERS", 100)
    written = recorded(own)
    shutil.rmtree(own)
    program = RecordingFile(io.BytesIO(written))["pump"].program
    assert isinstance(program, str)
    assert program.startswith(f"the program needs the library folder {own}; say where it is now")


def test_sources_and_descriptions_are_held(own: Path) -> None:
    (held,) = library_texts([own])
    assert (held.name, [path for path, _ in held.files]) == (
        "own", ["acme/sums/Constants.st", "acme/sums/Doubled.st", "acme/sums/library.toml"])
    assert LibraryTexts.of(held.as_data()) == held
    with unpacked([held]) as (folder,):
        assert library_texts([folder]) == (held,)
    assert not folder.exists()


@pytest.mark.parametrize("path", [
    "../Doubled.st", "/Doubled.st", "a/../../Doubled.st", "a\\..\\Doubled.st", "C:Doubled.st", "a//Doubled.st", "./Doubled.st",
    "a/ /Doubled.st", "Doubled.py", "Doubled\0.st", "/".join("a" * 20) + ".st"])  # fmt: skip
def test_a_file_cannot_have_others_written(path: str) -> None:
    with pytest.raises(ValueError, match=r"is no file of a library|sources and their descriptions only"):
        LibraryTexts.of(["own", [[path, DOUBLED]]])


def test_a_path_has_sixteen_parts_at_most() -> None:
    for parts, is_held in ((1, True), (15, True), (16, True), (17, False)):
        data = ["own", [["/".join(["a"] * (parts - 1) + ["b.st"]), DOUBLED]]]
        if is_held:
            assert LibraryTexts.of(data).as_data() == ["own", ((data[1][0][0], DOUBLED),)]
        else:
            with pytest.raises(ValueError, match=r"^'a/a/.*/b\.st' is no file of a library$"):
                LibraryTexts.of(data)


def test_libraries_are_held_in_their_order_up_to_a_size_and_with_names_that_every_system_takes(
        own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    other = tmp_path / "more" / "own"
    (other / "b" / "c").mkdir(parents=True)
    for path, text in (("b/c/Z.st", "z"), ("b/Y.toml", "yy"), ("A.st", "aaa"), ("X.ST", "no source")):
        (other / path).write_text(text, encoding="utf-8")
    (other / "Odd.st").write_bytes(b"\x00\xff\xfe\x00")
    both = library_texts([other, own])
    assert [held.name for held in both] == ["own", "own"]
    assert both[0].files == (("A.st", "aaa"), ("b/Y.toml", "yy"), ("b/c/Z.st", "z"))
    with unpacked(both) as folders:
        assert library_texts(folders) == both and len(set(folders)) == 2
    for most, found in ((6, 1), (5, 0)):
        monkeypatch.setattr(module, "MOST_CHARACTERS", most)
        assert len(library_texts([other])) == found
    monkeypatch.undo()
    (other / "b" / "|.st").write_text("x", encoding="utf-8")
    assert library_texts([other]) == ()


@pytest.mark.parametrize("name", ["..", ".", "", "a/b", "C:"])
def test_the_name_of_a_folder_leads_nowhere(name: str) -> None:
    with pytest.raises(ValueError, match=r"is no file of a library|sources and their descriptions only"):
        LibraryTexts.of([name, []])
