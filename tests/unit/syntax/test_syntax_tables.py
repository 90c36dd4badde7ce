"""The tables come from a cache file that may be missing, damaged, old or forbidden, and are the same in every case."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator
from pathlib import Path

import lark
import pytest

from fbvm.base.data import data_folder
from fbvm.syntax.st import tables as module
from fbvm.syntax.st.tables import FILES, STARTS, Tables, compile_grammar, grammar_text, tables


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setenv("FBVM_CACHE", str(tmp_path / "deep" / "cache"))
    yield tmp_path / "deep" / "cache"


def fresh(language: str = "mnemonics") -> Tables:
    """The tables as another process would get them; those of mnemonics are made in a moment."""
    return tables.__wrapped__(language)


@pytest.mark.slow
def test_a_missing_file_is_written_and_used(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = fresh("st")
    assert len(list((cache / "grammars").iterdir())) == 1
    monkeypatch.setattr(module, "compile_grammar", lambda *grammar: pytest.fail("the cache is not used"))
    assert fresh("st") == first == tables("st")


@pytest.mark.slow
@pytest.mark.parametrize("content", [
    b"", b"{", b"[]", b"null", b'{"rules": 1}', b"\xff\xfe", b"[" * 100_000], ids=range(7))
@pytest.mark.parametrize("whole", [True, False])
def test_a_damaged_file_is_replaced(cache: Path, content: bytes, whole: bool) -> None:
    """Whether or not the file's own hash fits."""
    fresh()
    (file,) = (cache / "grammars").iterdir()
    good = file.read_bytes()
    if whole:
        module.STORED.write(file.name, content)
    else:
        file.write_bytes(content)
    assert fresh() == tables("mnemonics")
    assert file.read_bytes() == good


@pytest.mark.slow
@pytest.mark.parametrize("spoil", [
    lambda t: t["actions"][0].update(NAME=99_999), lambda t: t.pop("rules"), lambda t: t["rules"][0].pop()],
    ids=["state", "rules", "rule"])
def test_a_file_with_wrong_contents_is_replaced(cache: Path, spoil: object) -> None:
    fresh()
    (file,) = (cache / "grammars").iterdir()
    good = file.read_bytes()
    bad = json.loads(module.STORED.read(file.name) or b"")
    spoil(bad)  # type: ignore[operator]
    module.STORED.write(file.name, json.dumps(bad).encode())
    assert fresh() == tables("mnemonics")
    assert file.read_bytes() == good


def test_a_folder_that_cannot_be_made_does_no_harm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("FBVM_CACHE", str(tmp_path / "file" / "cache"))
    assert fresh() == tables("mnemonics")


@pytest.mark.slow
def test_the_grammar_has_only_the_conflicts_that_are_meant(caplog: pytest.LogCaptureFixture) -> None:
    """A result type in front of a statement that begins with `(`, `[` or a name: that belongs to the type.  A `;`
    behind VAR sections belongs to them (of POUs, methods, accessors, PROPERTY_GET, prototypes), one behind END_STRUCT to the
    structure, a `(` behind __CATCH is that of its variable, and EXTENDS behind the name of a POU belongs to its head."""
    text = grammar_text("st")
    with caplog.at_level(logging.DEBUG, logger=lark.logger.name):
        lark.Lark(text, parser="lalr", start="source_text", debug=True, keep_all_tokens=True, maybe_placeholders=True)
    messages = [line for record in caplog.records for line in record.getMessage().splitlines()]
    conflicts = sorted(line for line in messages if "conflict" in line.lower())
    assert conflicts == ["Shift/Reduce conflict for terminal INHERITANCE: (resolving as shift)"] * 2 + [
        "Shift/Reduce conflict for terminal LPAR: (resolving as shift)"] * 4 + [
        "Shift/Reduce conflict for terminal LSQB: (resolving as shift)"] * 3 + [
        "Shift/Reduce conflict for terminal NAME: (resolving as shift)"] + [
        "Shift/Reduce conflict for terminal SEMICOLON: (resolving as shift)"] * 13


@pytest.mark.slow
def test_the_grammar_is_plain_lark() -> None:
    text = grammar_text("st")
    tree = lark.Lark(text + "\n%ignore /\\s+/", parser="lalr", start="source_text").parse("PROGRAM p x := 1; END_PROGRAM")
    assert isinstance(tree, lark.Tree) and compile_grammar(text, STARTS["st"])["rules"]


def test_every_production_is_named() -> None:
    for name in FILES["st"][1:]:
        lines = (data_folder("grammar") / name).read_text(encoding="utf-8").splitlines()
        assert sum(line.startswith("// ") for line in lines) > 20
