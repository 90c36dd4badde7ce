"""Devices, pipes, links and packed files in the place of a file: each is refused at once, in words."""

from __future__ import annotations

import os
import re
import struct
import sys
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from growth import assert_linear
from old_files import write_old_journal, write_old_trace
from rows import each_of, first_quick

from fbvm.base import files
from fbvm.base.diagnostics import Source
from fbvm.cli.main import main
from fbvm.code.compiler import compile_sources
from fbvm.interchange.plcopen.read.importing import import_xml
from fbvm.interchange.plcopen.write.exporting import export_xml
from fbvm.record.trace import format as trace_format
from fbvm.syntax.formatter.formatter import formatted

COUNTER = "PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM\n"
Fbvm = Callable[..., Result]
needs_devices = pytest.mark.skipif(sys.platform == "win32", reason="the system has no such files")
XML = "<project xmlns='http://www.plcopen.org/xml/tc6_0201'><types><pous>{}</pous></types></project>"
POU = "<pou name='{}' pouType='functionBlock'><interface/><body><ST>;</ST></body></pou>"


@pytest.fixture
def fbvm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Fbvm:
    """Runs the command in a folder with `counter.st`; an exception that it lets through fails the test."""
    monkeypatch.chdir(tmp_path)
    Path("counter.st").write_text(COUNTER, encoding="utf-8")
    Path("own").mkdir()
    return lambda *arguments: CliRunner().invoke(main, arguments, catch_exceptions=False)


@pytest.mark.slow
@needs_devices
@each_of(("verb", "status"), [
    (("check", "{}"), 3), (("fmt", "{}"), 3), (("list", "{}"), 3), (("export", "{}", "-o", "out.xml"), 3),
    (("run", "{}", "--scans", "2"), 3), (("step", "{}"), 3), (("import", "{}", "-o", "out"), 3), (("replay", "{}"), 2),
    (("chart", "{}"), 2), (("table", "{}", "D0"), 2), (("why", "D0", "{}"), 2),
    (("serve", "--bind", "nobody", "--image", "{}"), 2),
])
@pytest.mark.parametrize("what", ["device", "link", "pipe"])
def test_what_is_no_file_is_refused(fbvm: Fbvm, what: str, verb: tuple[str, ...], status: int) -> None:
    named = {"device": "/dev/zero", "link": "zero.csv", "pipe": "pipe.csv"}[what]
    if what == "link" and not os.path.lexists(named):
        os.symlink("/dev/zero", named)
    if what == "pipe" and not os.path.lexists(named):
        os.mkfifo(named)
    result = fbvm(*(word.format(named) for word in verb))
    assert result.exit_code == status
    assert "it is no file" in result.output or "is no file" in result.output
    assert fbvm("convert", named, "back.fbtrace").exit_code == 2


@needs_devices
@pytest.mark.parametrize("what", ["device", "pipe"])
def test_what_is_no_file_in_a_project_or_a_library(fbvm: Fbvm, what: str) -> None:
    make: Callable[[str], None] = os.mkfifo if what == "pipe" else lambda path: os.symlink("/dev/zero", path)
    for name in ("own/library.toml", "source.st"):
        make(name)
    result = fbvm("check", "counter.st", "--library", "own")
    assert result.exit_code == 3
    assert "it is no file" in result.output
    Path("fbvm.toml").write_text('[plc.One]\nsources = ["source.st"]\n', encoding="utf-8")
    for verb in ("check", "run"):
        result = fbvm(verb, "fbvm.toml", *(["--scans", "2"] if verb == "run" else []))
        assert result.exit_code == 3
        assert "it is no file" in result.output
    os.unlink("own/library.toml")
    make("own/Other.st")
    assert fbvm("check", "counter.st", "--library", "own").exit_code == 0
    Path("counter.st").write_text("PROGRAM Main VAR o : Other; END_VAR o(); END_PROGRAM\n", encoding="utf-8")
    assert "it is no file" in fbvm("check", "counter.st", "--library", "own").output


def test_a_disk_in_the_place_of_a_library_is_refused(fbvm: Fbvm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "MOST_FOLDERS", 3)
    for name in "abc":
        Path("own", name).mkdir()
        Path("own", name, f"{name}.st").write_text(COUNTER, encoding="utf-8")
    assert fbvm("check", "counter.st", "--library", "own").exit_code == 0
    Path("own/d").mkdir()
    refused = fbvm("check", "counter.st", "--library", "own")
    assert refused.exit_code == 2 and "it has more than 3 folders" in refused.output
    assert [each.code for each in compile_sources([Source("counter.st", COUNTER)], libraries=[Path("own")]).errors] == ["P0201"]


@needs_devices
def test_links_that_lead_to_one_another_are_refused_wherever_a_path_is_written(fbvm: Fbvm) -> None:
    os.symlink("loop.st", "loop.st")
    Path("wrong.st").write_text("PROGRAM Main VAR o : Other; END_VAR o(); END_PROGRAM\n", encoding="utf-8")
    result = fbvm("check", "wrong.st")  # which looks for a declaration in the files beside
    assert (result.exit_code, "there is no type or block Other" in result.output) == (3, True)
    for row, said in (('sources = ["loop.st"]', "loop.st cannot be read: "), ('sources = ["loop.st/a.st"]', "there is no file"),
                      ('sources = ["counter.st"]\nlibraries = ["loop.st"]', "there is no folder loop.st"),
                      ('sources = ["counter.st"]\n[[picture]]\nfile = "loop.st"\nbind = []', "there is no file loop.st")):
        Path("fbvm.toml").write_text(f"[plc.One]\n{row}\n", encoding="utf-8")
        result = fbvm("check", "fbvm.toml")
        assert (result.exit_code, said in result.output) == (3, True), result.output
    for name in ("loop.st", "loop.st/project"):
        assert "cannot be written" in fbvm("new", name).output


@pytest.mark.slow
def test_a_file_that_is_too_large(fbvm: Fbvm) -> None:
    with Path("large.st").open("wb") as file:
        file.truncate(files.SOURCE_BYTES + 1)
    os.rename("large.st", "fbvm.toml")
    assert "1 MiB" in fbvm("check", "fbvm.toml").output
    assert "16 MiB" in fbvm("serve", "--bind", "nobody", "--image", "fbvm.toml").output
    os.rename("fbvm.toml", "own/library.toml")
    assert "1 MiB" in fbvm("check", "counter.st", "--library", "own").output


# --- recordings -------------------------------------------------------------------------------------------------------


def chunk(kind: int, packed: bytes, scans: int = 0) -> bytes:
    return struct.pack("<BIIQI", kind, len(packed), zlib.crc32(packed), 0, scans) + packed


def many_zeros(size: int, times: int) -> bytes:
    """`size` * `times` zeros, packed; each `size` of them is the same piece of the format (RFC 1950, 1951)."""
    engine = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    piece = engine.compress(bytes(size)) + engine.flush(zlib.Z_FULL_FLUSH)
    checksum = (size * times % 65521) << 16 | 1
    return b"\x78\xda" + piece * times + b"\x03\x00" + checksum.to_bytes(4, "big")


def test_zeros_are_packed() -> None:
    assert zlib.decompress(many_zeros(1 << 16, 3)) == bytes(3 << 16)


@pytest.mark.slow
@pytest.mark.parametrize("largest", first_quick([1 << 22, trace_format.LARGEST_BYTES]))
def test_a_trace_that_is_much_larger_when_unpacked(fbvm: Fbvm, largest: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trace_format, "LARGEST_BYTES", largest)
    monkeypatch.setattr(trace_format, "LARGEST_HEADER_BYTES", min(largest, trace_format.LARGEST_HEADER_BYTES))
    write_old_trace("run.fbtrace", COUNTER)
    packed = many_zeros(1 << 22, (largest >> 22) + 1)
    assert len(packed) < 1 << 20
    whole = Path("run.fbtrace").read_bytes()
    for data in (whole + chunk(trace_format.BLOCK, packed, 1), trace_format.MAGIC + chunk(trace_format.HEADER, packed)):
        Path("bomb.fbtrace").write_bytes(data)
        result = fbvm("chart", "bomb.fbtrace", "D0")
        assert result.exit_code == 2
        assert "too large" in result.output


@pytest.mark.slow
@each_of("header", [b"[" * 100_000, b'{"format":' * 50_000, b'{"a":' + b"9" * 5000 + b"}"])
def test_a_header_of_a_trace_that_is_nested_deeply(fbvm: Fbvm, header: bytes) -> None:
    Path("deep.fbtrace").write_bytes(trace_format.MAGIC + chunk(trace_format.HEADER, zlib.compress(header)))
    result = fbvm("chart", "deep.fbtrace")
    assert result.exit_code == 2
    assert "header is damaged" in result.output


@pytest.mark.slow
def test_a_memory_image_that_is_nested_deeply(fbvm: Fbvm) -> None:
    Path("image.json").write_text("[" * 100_000, encoding="utf-8")
    assert "is not JSON" in fbvm("serve", "--bind", "nobody", "--image", "image.json").output


# --- import -----------------------------------------------------------------------------------------------------------


def test_names_that_no_file_system_has(fbvm: Fbvm) -> None:
    names = ["a" * 300, "A" * 300, "CON", "aux", "lpt1", "\u00e4" * 300]
    Path("in.xml").write_text(XML.format("".join(map(POU.format, names))), encoding="utf-8")
    assert fbvm("import", "in.xml", "-o", "out").exit_code == 0
    written = sorted(path.name for path in Path("out").iterdir())
    assert len(written) == len(names)
    assert {"CON_.st", "aux_.st", "lpt1_.st"} < set(written)
    assert fbvm("import", "in.xml", "-o", "out").exit_code == 2


@pytest.mark.slow
def test_the_time_of_an_import_grows_with_its_pous() -> None:
    def prepared(count: int) -> Callable[[], None]:
        document = XML.format("".join(POU.format(f"P{at}") for at in range(count))).encode()

        def imports() -> None:
            assert len(import_xml(document).files) == count

        return imports

    assert_linear(prepared, 2000)


def of_interfaces(count: int) -> str:
    """A program with interfaces that each have a block of their own."""
    parts = "".join(f"INTERFACE I{at} METHOD M : INT END_METHOD END_INTERFACE\n"
                    f"FUNCTION_BLOCK C{at} IMPLEMENTS I{at} METHOD PUBLIC M : INT M := 1; END_METHOD END_FUNCTION_BLOCK\n"
                    for at in range(count))
    held = "".join(f"c{at} : C{at}; i{at} : I{at}; " for at in range(count))
    return f"{parts}PROGRAM Main VAR {held}r : INT; END_VAR {''.join(f'r := i{at}.M(); ' for at in range(count))}END_PROGRAM\n"


def of_one_interface(count: int) -> str:
    """Blocks that implement one interface, and calls that may mean each of them."""
    parts = "".join(f"FUNCTION_BLOCK C{at} IMPLEMENTS I METHOD PUBLIC M : INT M := 1; END_METHOD END_FUNCTION_BLOCK\n"
                    for at in range(count))
    held, calls = "".join(f"c{at} : C{at}; " for at in range(count)), "".join(f"i := c{at}; r := i.M(); " for at in range(count))
    return (f"INTERFACE I METHOD M : INT END_METHOD END_INTERFACE\n{parts}"
            f"PROGRAM Main VAR {held}i : I; r : INT; END_VAR {calls}END_PROGRAM\n")


def of_jumps(count: int) -> str:
    """An instruction list with a label and a jump to the next one again and again."""
    lines = "".join(f"l{at}: LD n\nGT 100\nJMPCN l{at + 1}\n" for at in range(count))
    return f"PROGRAM Main VAR n : INT; END_VAR\n{lines}l{count}: LD 1\nST n\nEND_PROGRAM\n"


def of_far_jumps(count: int) -> str:
    """A program all of whose jumps stand in front of all of their labels."""
    jumps = "".join(f"IF n = {at} THEN JMP l{at}; END_IF\n" for at in range(count))
    return f"PROGRAM Main VAR n : INT; END_VAR\n{jumps}{''.join(f'l{at}: n := {at};' for at in range(count))}\nEND_PROGRAM\n"


def of_bases(count: int) -> str:
    """A block that extends one that extends another, each with a method of its own."""
    parts = "".join(f"FUNCTION_BLOCK F{at + 1} EXTENDS F{at} METHOD M{at} : INT M{at} := 1; END_METHOD END_FUNCTION_BLOCK\n"
                    for at in range(count))
    return f"FUNCTION_BLOCK F0 END_FUNCTION_BLOCK\n{parts}PROGRAM Main VAR f : F{count}; END_VAR f(); END_PROGRAM\n"


def of_namespaces(count: int) -> str:
    """Namespaces inside one another, and a program beside them."""
    return f"{'NAMESPACE a ' * count}{'END_NAMESPACE ' * count}\nPROGRAM Main END_PROGRAM\n"


DRAWN = "PROGRAM Main\nVAR a, b : BOOL; END_VAR\nLADDER\n{}\nEND_LADDER\nEND_PROGRAM\n"


def of_drawn_contacts(count: int) -> str:
    """A drawn rung with contacts one behind the other."""
    return DRAWN.format(f"    {'   a   ' * count}   b\n   |{'--| |--' * count}--( )--|")


def of_drawn_coils(count: int) -> str:
    """A drawn rung with coils one below the other."""
    below = "\n   |       |       b\n   |       +------( )--|"
    return DRAWN.format(f"       a           b\n   |--| |--+------( )--|{below * count}")


def of_unknown_names(count: int) -> str:
    """A program that declares names and uses others."""
    declared = "".join(f"y{at} : INT; " for at in range(count))
    return f"PROGRAM Main VAR {declared}END_VAR {''.join(f'x{at} := 1; ' for at in range(count))}END_PROGRAM\n"


def of_comments_on_one_line(count: int) -> str:
    """A program on one line, with comments between its statements."""
    return f"PROGRAM Main VAR n : INT; END_VAR {'n := 1; (* a *) ' * count}END_PROGRAM\n"


def of_comments_behind_a_statement(count: int) -> str:
    """A program with many comments behind its only statement."""
    return f"PROGRAM Main VAR n : INT; END_VAR n := 1;{' (* a *)' * count}\nEND_PROGRAM\n"


def of_properties(count: int) -> str:
    """A block with properties."""
    parts = "".join(f"PROPERTY PUBLIC P{at} : INT GET P{at} := 1; END_GET END_PROPERTY\n" for at in range(count))
    return f"FUNCTION_BLOCK F\n{parts}END_FUNCTION_BLOCK\n"


def compiled(source: Source) -> bool:
    return compile_sources([source], runnable=True).image is not None


def refused(source: Source) -> bool:
    return compile_sources([source]).image is None


def laid_out(source: Source) -> bool:
    return not formatted(source)[1]


def exported(source: Source) -> bool:
    return export_xml([source], "x", "2020-01-01T00:00:00").text is not None


@pytest.mark.slow
@each_of(("made", "few", "work"), [
    (of_interfaces, 150, compiled), (of_one_interface, 70, compiled), (of_jumps, 500, compiled), (of_far_jumps, 100, compiled),
    (of_bases, 50, compiled), (of_namespaces, 500, compiled), (of_drawn_contacts, 200, compiled), (of_drawn_coils, 200, compiled),
    (of_unknown_names, 1500, refused), (of_comments_on_one_line, 3000, laid_out),
    (of_comments_behind_a_statement, 10000, laid_out), (of_properties, 400, exported),
])  # fmt: skip
def test_the_time_of_a_compilation_grows_with_its_parts(made: Callable[[int], str], few: int,
                                                        work: Callable[[Source], bool]) -> None:  # fmt: skip
    def prepared(count: int) -> Callable[[], None]:
        source = Source("x.st", made(count))

        def works() -> None:
            assert work(source)

        return works

    assert_linear(prepared, few)


@needs_devices
def test_a_link_that_leads_nowhere_is_not_followed(fbvm: Fbvm) -> None:
    Path("in.xml").write_text(XML.format(POU.format("Pump")), encoding="utf-8")
    Path("out").mkdir()
    os.symlink("../elsewhere.st", "out/Pump.st")
    assert "is there already" in fbvm("import", "in.xml", "-o", "out").output
    assert fbvm("import", "in.xml", "-o", "out", "--force").exit_code == 0
    assert not Path("elsewhere.st").exists()
    assert "Pump" in Path("out/Pump.st").read_text(encoding="utf-8")


def test_an_export_of_a_file_with_an_impossible_time(fbvm: Fbvm) -> None:
    os.utime("counter.st", (1e12, 1e12))
    assert fbvm("export", "counter.st", "-o", "out.xml").exit_code == 0
    assert re.search(r'creationDateTime="\d{4}-', Path("out.xml").read_text(encoding="utf-8"))


@pytest.mark.slow
def test_a_journal_with_an_endless_line(fbvm: Fbvm, monkeypatch: pytest.MonkeyPatch) -> None:
    write_old_journal("run.journal", COUNTER)
    with Path("run.journal").open("a", encoding="utf-8") as file:
        file.write('{"scan":' * 100_000)
    assert fbvm("replay", "run.journal").exit_code == 0
