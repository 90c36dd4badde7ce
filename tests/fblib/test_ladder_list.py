"""The list of instructions, and what `fbvm explain` says of each: both are made of the table and the library."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from click.testing import CliRunner
from rows import each_of

from fbvm.base.data import data_folder
from fbvm.check.instructions import find, flags, meaning, page
from fbvm.cli.main import main
from fbvm.syntax.ladder.instructions.instruction_set import ELSEWHERE, instruction_set

LIST = Path(__file__).parents[2] / "fblib/omron/ladder/INSTRUCTIONS.md"
HEAD = """# The instructions of Omron CS/CJ ladder

Those of `grammar/mnemonics.txt`, executed or refused by name; `fbvm explain MOV` says the same of one. Flags are those that an
instruction writes or reads, P_ in front of each. This list is made by `FBVM_REWRITE=1 pytest tests/fblib/test_ladder_list.py`.
"""


def listed() -> str:
    lines = [HEAD]
    for line in (data_folder("grammar") / "mnemonics.txt").read_text(encoding="utf-8").splitlines():
        if line.startswith("# ---"):
            section = line.removeprefix("# ---").strip()
            title = section.split(" ", 1)[1] if section[0].isdigit() else section
            lines += ["", f"## {title[0].upper()}{title[1:]}", "", "| instruction | operands | flags | |", "|---|---|---|---|"]
        elif line.strip() and not line.startswith("#"):
            row = find(line.split("|")[0])
            assert row is not None
            name = (row.mnemonic.removeprefix("LD") if row.kind == "?" else row.mnemonic) + (f"({row.code})" if row.code else "")
            shown = " ".join(flag.removeprefix("P_") for flag in flags(row))
            said = meaning(row) if row.does else f"**refused**: {meaning(row)}"
            lines.append(f"| `{name}` | {' '.join(row.names).strip()} | {shown} | {said} |")
    return "\n".join(lines) + "\n"


@pytest.mark.slow
def test_the_list_is_as_the_table_and_the_library() -> None:
    text = listed()
    if os.environ.get("FBVM_REWRITE"):
        LIST.write_text(text, encoding="utf-8")
    assert LIST.read_text(encoding="utf-8") == text


@pytest.mark.slow
def test_everything_says_what_it_does_or_why_it_is_refused() -> None:
    for row in instruction_set().rows.values():
        assert len(meaning(row)) > 10, row.mnemonic
        assert page(row).startswith(row.mnemonic)


@each_of(("name", "part"), [
    ("mov", "flags: P_ER P_EQ P_N"), ("=", "a contact"), ("PMCR", "no serial line"), ("SFT", "takes 3 conditions"),
    ("@mov", "MOV(021)"), ("MOV(021)", "MOV(021)"), ("21", "MOV(021)"), ("@<>", "a contact")])
def test_explain(name: str, part: str) -> None:
    result = CliRunner().invoke(main, ["explain", name])
    assert result.exit_code == 0
    assert part.lower() in result.output.lower()


def test_explain_offers_what_may_be_meant() -> None:
    said = CliRunner().invoke(main, ["explain", "movw"]).output
    assert "there is no diagnostic, instruction, block or function movw; did you mean MOV" in said
    assert "did you mean" not in CliRunner().invoke(main, ["explain", "zzzz"]).output
    assert "did you mean TON or" in CliRunner().invoke(main, ["explain", "TONN"]).output
    assert "did you mean LIMIT or LMT?" in CliRunner().invoke(main, ["explain", "limits"]).output
    assert "interface" not in CliRunner().invoke(main, ["explain", "INT"]).output


def test_what_other_tools_call_an_instruction_leads_to_one_that_there_is() -> None:
    rows = instruction_set().rows
    for name, ours in ELSEWHERE.items():
        assert name not in rows and (ours in rows or ours.partition(" ")[0] in rows), name
