"""Files in any encoding that a PLC tool writes; what is no text is refused."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from rows import each_of

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.code.compiler import compile_text
from fbvm.syntax.text import decode, read

TEXT = "PROGRAM p (* é € *) END_PROGRAM\r\n"


@pytest.mark.parametrize("data", [
    TEXT.encode("utf-8"), TEXT.encode("utf-8-sig"), TEXT.encode("utf-16"), b"\xfe\xff" + TEXT.encode("utf-16-be"),
    TEXT.encode("cp1252")], ids=["utf-8", "utf-8 with mark", "utf-16-le", "utf-16-be", "windows"])
def test_encodings(data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "x.st"
    path.write_bytes(data)
    source = read(path, "x.st", "lib")
    assert isinstance(source, Source)
    assert (source.text, source.name, source.library) == (TEXT, "x.st", "lib")


def test_bytes_that_windows_does_not_know_are_latin_1() -> None:
    source = decode(b"(* \x81 *)", "x")
    assert isinstance(source, Source) and source.text == "(* \x81 *)"


@each_of("data", [
    b"\x7fELF\0\0", b"PROGRAM\0", TEXT.encode("utf-16-le"), b"\xff\xfea", b"\x1b[0m", b"\xef\xbb\xbf\xff"],
    ids=["program", "nul", "no mark", "half a word", "escape", "wrong utf-8"])
def test_binary_files_are_refused(data: bytes) -> None:
    refusal = decode(data, "x.st")
    assert isinstance(refusal, Diagnostic)
    assert refusal.code == "S0107" and refusal.render().startswith("x.st:1:1: error S0107: x.st cannot be read: ")


def test_files_that_cannot_be_opened_are_refused(tmp_path: Path) -> None:
    for path in (tmp_path / "none.st", tmp_path):
        refusal = read(path, "x.st")
        assert isinstance(refusal, Diagnostic) and refusal.code == "S0107"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    refusal = read(tmp_path / "pipe", "x.st")
    assert isinstance(refusal, Diagnostic) and refusal.code == "S0107"


def test_an_empty_file_is_a_source() -> None:
    source = decode(b"", "x")
    assert isinstance(source, Source) and source.text == ""


def test_lines_may_end_with_cr_alone() -> None:
    made = compile_text("PROGRAM Main // name\rVAR a : INT; END_VAR\r\n(* two\rlines *)\ra := c;\rEND_PROGRAM\r")
    assert [(d.code, d.line, d.column) for d in made.diagnostics] == [("S0201", 5, 6)]
    assert "a := c;" in made.diagnostics[0].render().splitlines()[1]


@each_of("rest", ["\x1a", "\x1a\x1a\r\n", "\0\0\0", "\x1a\0 \n"])
def test_what_old_machines_write_behind_a_text_is_passed_over(rest: str) -> None:
    assert compile_text("PROGRAM Main\r\nEND_PROGRAM\r\n" + rest).diagnostics == []
    assert [d.code for d in compile_text(f"PROGRAM Main {rest} END_PROGRAM").diagnostics] == ["S0102"]


@pytest.mark.parametrize("text", ['<?xml version="1.0"?>\n<project/>', '\n<project xmlns="x"><type>?</type></project>'])
def test_xml_is_one_mistake_with_its_mend(text: str) -> None:
    (diagnostic,) = compile_text(text).diagnostics
    assert diagnostic.code == "S0101" and "this is XML" in diagnostic.render()
    assert "fbvm import FILE.xml -o DIR" in diagnostic.render()


def test_xml_of_twincat_is_told_from_plcopen() -> None:
    for text in ('<?xml version="1.0"?>\n<TcPlcObject Version="1.1"/>',
                 '<?xml version="1.0"?>\n<Project xmlns="http://schemas.microsoft.com/developer/msbuild/2003"/>'):
        (diagnostic,) = compile_text(text).diagnostics
        assert "of TwinCAT" in diagnostic.hint and "import" not in diagnostic.hint
