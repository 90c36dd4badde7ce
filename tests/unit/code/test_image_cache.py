"""Compilations on disk: read when nothing that they depend on has changed, and only then."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from click.testing import CliRunner

from fbvm.base import cache
from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.cli.main import main
from fbvm.code.compiler import Compilation, compile_files, driver
from fbvm.code.store import cache as image_cache
from fbvm.code.store.encoding import encode

PROGRAM = """
FUNCTION_BLOCK Own
VAR_OUTPUT Done : BOOL; END_VAR
    Done := TRUE;
END_FUNCTION_BLOCK
PROGRAM Main
VAR b : Own; d : TON; l : Lib; unused : INT; END_VAR
    b(); d(IN := b.Done, PT := T#1s); l();
END_PROGRAM
"""
LIB = "FUNCTION_BLOCK Lib\nVAR n : INT; END_VAR\n    n := n + 1;\nEND_FUNCTION_BLOCK\n"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("FBVM_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    Path("main.st").write_text(PROGRAM, encoding="utf-8")
    Path("lib").mkdir()
    Path("lib/Lib.st").write_text(LIB, encoding="utf-8")
    return tmp_path / "cache" / "images"


@pytest.fixture
def anew(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Grows with each compilation that is done anew."""
    counted: list[int] = []
    compile_sources = driver.compile_sources

    def counting(*arguments: object, **options: object) -> Compilation:
        counted.append(1)
        return compile_sources(*arguments, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(driver, "compile_sources", counting)
    return counted


def compiled(**options: object) -> Compilation:
    made = compile_files(["main.st"], libraries=["lib"], **options)  # type: ignore[arg-type]
    assert made.image
    return made


def test_the_second_time_it_is_read(anew: list[int]) -> None:
    first, second = compiled(), compiled()
    assert len(anew) == 1
    assert first.image and second.image
    assert encode(first.image) == encode(second.image)
    assert [message.render() for message in first.diagnostics] == [message.render() for message in second.diagnostics]
    assert [message.code for message in second.diagnostics] == ["S0290"]


@pytest.mark.parametrize("options", [{"program": "Main"}, {"runnable": True}, {"lint": False}, {"no_warn": ["S0290"]}])
def test_options_count(anew: list[int], options: dict[str, object]) -> None:
    compiled()
    compiled(**options)
    compiled(**options)
    assert len(anew) == 2


@pytest.mark.parametrize(("file", "text"), [
    ("main.st", PROGRAM + "// more\n"), ("lib/Lib.st", LIB.replace("+ 1", "+ 2")), ("lib/Other.st", LIB.replace("Lib", "Other")),
    ("lib/library.toml", "globals = []\n"),
])  # fmt: skip
def test_sources_and_libraries_count(anew: list[int], file: str, text: str) -> None:
    compiled()
    Path(file).write_text(text, encoding="utf-8")
    compiled()
    assert len(anew) == 2


def test_a_library_file_that_cannot_be_read_counts_with_its_reason(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = []
    for error in (None, FileNotFoundError(2, "gone"), PermissionError(13, "not yours")):
        def read(path: Path, most: int, error: OSError | None = error) -> bytes:
            if error:
                raise error
            return b""

        monkeypatch.setattr(image_cache, "read_file", read)
        names.append(image_cache.name([], [Path("lib")], []))
    assert len(set(names)) == 3


def test_another_name_of_a_source_counts(anew: list[int]) -> None:
    compiled()
    Path("main.st").rename("other.st")
    compile_files(["other.st"], libraries=["lib"])
    assert len(anew) == 2


def test_another_version_counts(anew: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    compiled()
    monkeypatch.setattr(image_cache, "_own", lambda: "another")
    compiled()
    assert len(anew) == 2


def test_the_state_of_files_is_where_they_are_how_large_and_when_they_were_written(tmp_path: Path) -> None:
    states = []
    for name, text, at_ns in (("One.st", "a", 5), ("One.st", "a", 5), ("One.st", "ab", 5), ("One.st", "ab", 6),
                              ("b/Two.st", "", 6), ("README.md", "for people", 6)):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
        os.utime(tmp_path / name, ns=(at_ns, at_ns))
        cache.state_of.cache_clear()
        states.append(cache.state_of(tmp_path))
    assert [states.index(state) for state in states] == [0, 0, 2, 3, 4, 4]


def test_errors_are_not_kept(anew: list[int], folder: Path) -> None:
    Path("main.st").write_text("PROGRAM Main\n    x := 1;\nEND_PROGRAM\n", encoding="utf-8")
    for _ in range(2):
        assert [message.code for message in compile_files(["main.st"]).diagnostics] == ["S0201"]
    assert len(anew) == 2
    assert not folder.exists()


@pytest.mark.parametrize("at", [0, 20, 300, -1])
def test_a_damaged_file_is_passed_over(anew: list[int], folder: Path, at: int) -> None:
    compiled()
    (file,) = folder.iterdir()
    content = bytearray(file.read_bytes())
    content[at] ^= 1
    file.write_bytes(content)
    assert compiled().image
    assert len(anew) == 2


def test_a_whole_file_of_something_else_is_passed_over(anew: list[int], folder: Path) -> None:
    compiled()
    (file,) = folder.iterdir()
    image_cache.FILES.write(file.name, b"\4\0\0\0null{}")
    assert compiled().image
    assert len(anew) == 2


def test_what_is_not_wanted_is_not_used(anew: list[int], folder: Path) -> None:
    compiled(cache=False)
    assert not folder.exists()
    compiled()
    compiled(cache=False)
    assert len(anew) == 3


@pytest.mark.slow
def test_the_command_line_can_do_without(anew: list[int], folder: Path) -> None:
    for _ in range(2):
        result = CliRunner().invoke(main, ["run", "main.st", "--library", "lib", "--scans", "1", "--no-cache"])
        assert result.exit_code == 0
    assert len(anew) == 2
    assert not folder.exists()
    cache.switch(True)
    compiled()
    assert folder.exists()


def test_messages_come_back_with_their_places_and_one_about_a_library_keeps_all_from_disk() -> None:
    image = compiled().image
    assert image is not None
    sources = [Source("a.st", "text of a"), Source("b.st", "text of b")]
    first = Diagnostic("S0290", sources[1], 1, 3, "never used", "remove it", (sources[0], 4, "declared here"), True)
    second = Diagnostic("S0390", sources[0], 0, 2, "compared")
    named = image_cache.name(sources, [], ["Main"])
    assert image_cache.read(named, sources) is None
    image_cache.write(named, sources, image, [first, second])
    found = image_cache.read(named, sources)
    assert found is not None and found[1] == [first, second] and encode(found[0]) == encode(image)
    assert found[1][0].source is sources[1] and found[1][0].related is not None and found[1][0].related[0] is sources[0]
    other = image_cache.name(sources, [], ["Other"])
    for about in (Diagnostic("S0290", Source("TON.st", "", "iec"), 0, 1, "x"), Diagnostic("S0290", sources[0], 0, 1, "x", "", (
            Source("TON.st", "", "iec"), 0, "there"))):  # fmt: skip
        image_cache.write(other, sources, image, [about])
        assert image_cache.read(other, sources) is None
