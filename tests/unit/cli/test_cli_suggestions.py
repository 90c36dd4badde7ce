"""Typing mistakes in verbs and names of files, and files that are no sources."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from click.testing import CliRunner
from rows import each_of

from fbvm.cli.main import main


def refused(*arguments: str) -> str:
    """The last line of what the command says; its status is 2."""
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 2, result.output
    return result.stderr.splitlines()[-1]


@each_of("typed, said", [
    ("chek", "Error: There is no command 'chek'; did you mean check?"),
    ("rn", "Error: There is no command 'rn'; did you mean run?"),
    ("RUN", "Error: There is no command 'RUN'; did you mean run?"),
    ("convrt", "Error: There is no command 'convrt'; did you mean convert?"),
    ("xyz", "Error: There is no command 'xyz'"),
    (__file__, f"Error: There is no command '{__file__}'; run the file by `fbvm run {__file__}`"),
])  # fmt: skip
def test_a_misspelt_verb(typed: str, said: str) -> None:
    assert refused(typed) == said


@each_of("typed, meant", [("dialect", "dialects"), ("fautl", "fault"), ("TONN", "TON or TKON")])
def test_a_misspelt_page(typed: str, meant: str) -> None:
    said = CliRunner().invoke(main, ["explain", typed]).stderr
    assert f"there is no diagnostic, instruction, block or function {typed}; did you mean {meant}?" in said


@each_of("arguments, said", [
    (["run", "pmp.st"], "Path 'pmp.st' does not exist; did you mean pump.st?"),
    (["check", "pump"], "Path 'pump' does not exist; did you mean pump.st?"),
    (["step", "src/mian.st"], f"Path 'src/mian.st' does not exist; did you mean src{os.sep}main.st?"),
    (["fmt", "PUMPS.ST"], "Path 'PUMPS.ST' does not exist; did you mean pump.st?"),
    (["list", "zzz.st"], "Path 'zzz.st' does not exist"),
    (["chart", "rum.fbtrace"], "File 'rum.fbtrace' does not exist; did you mean run.fbtrace?"),
    (["why", "Main.n", "rum.fbtrace"], "File 'rum.fbtrace' does not exist; did you mean run.fbtrace?"),
    (["run", "pump.st", "--library", "scr"], "Directory 'scr' does not exist; did you mean src?"),
    (["check", "none/pump.st"], "Path 'none/pump.st' does not exist"),
])  # fmt: skip
def test_a_misspelt_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], said: str) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "src").mkdir(exist_ok=True)
    for name in ("pump.st", "run.fbtrace", "src/main.st"):
        (tmp_path / name).touch()
    assert refused(*arguments).endswith(f": {said}")


PAGE = "and no source of a program; open it in a browser"


@each_of("verb", ["run", "check", "step", "fmt", "list", "ladder", "sfc", "export"])
def test_a_page_is_one_message(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, verb: str) -> None:
    """Also before it is asked when the run is to end."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "page.html").write_text("<!doctype html>\n<html><title>x</title></html>\n", encoding="utf-8")
    assert refused(verb, "page.html").endswith(f": page.html is a page {PAGE}")


@each_of("name, data, said", [
    ("a.htm", b"", f"a.htm is a page {PAGE}"),
    ("a.st", b"\xef\xbb\xbf  <HTML>", f"a.st is a page {PAGE}"),
    ("a.fbtrace", b"FBVMTRC1\0\0", "a.fbtrace is a trace and no source of a program; `fbvm chart`, `fbvm table` and "
                                   "`fbvm why` look at it"),
    ("a.txt", b'{"journal": 3, "image": ""}', "a.txt is a journal and no source of a program; `fbvm replay` does its run again"),
    ("a.xml", b"<?xml version='1.0'?>", "a.xml is XML and no source of a program; `fbvm import a.xml -o DIR` makes sources of a "
                                        "PLCopen project"),
    ("a.zip", b"PK\x03\x04", "a.zip is no text and no source of a program; unpack or export the sources from it"),
])  # fmt: skip
def test_what_a_file_is_that_is_no_source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, data: bytes,
                                          said: str) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).write_bytes(data)
    assert refused("check", name).endswith(f": {said}")
