"""`fbvm explain`: the page of a diagnostic, a ladder instruction, a block of the libraries or a standard function."""

from __future__ import annotations

import re
from difflib import get_close_matches

import click

from fbvm.base import dialects
from fbvm.base.codes import CODES
from fbvm.base.pages import UnknownCode, page
from fbvm.check import block_pages, function_pages, instructions
from fbvm.check.calls.functions import SIGNATURES
from fbvm.cli.shared.terminal import say
from fbvm.syntax.ladder.instructions.instruction_set import meant, spelling

_CODE = re.compile(r"[A-Z]?\d+", re.I)


def _unknown(error: UnknownCode) -> str:
    """That there is no such page, and of which names there are some; a name that looks like a code may be a code only."""
    if _CODE.fullmatch(error.code.strip()):
        return str(error)
    instruction_names = [found.mnemonic for name in meant(spelling(error.code)) if (found := instructions.find(name))]
    pages = get_close_matches(error.code.strip().lower(), ("dialects", "fault"), 1, 0.8)
    others = get_close_matches(error.code.strip().upper(), [*block_pages.names(), *SIGNATURES], 2, 0.8)
    names = " or ".join(pages or dict.fromkeys([*others, *instruction_names]))
    rows = "".join(f"\n  {row.code}  {row.title}" for row in error.near)
    said = f"there is no diagnostic, instruction, block or function {error.code}"
    return said + (f"; did you mean {names}?" if names else "") + (f"\nDiagnostics near it are{rows}" if rows else "")


@click.command("explain")
@click.argument("code", metavar="CODE|NAME", required=False)
def command(code: str | None) -> None:
    """Print the page of a diagnostic: a wrong program, the reason, the repair.  Without an
    argument: the list of all codes.

    `fbvm explain MOV` says what an instruction of ladder does, with its operands and flags; `fbvm explain TON` what a block
    or function of the libraries does, with its pins, and `fbvm explain LIMIT` what a standard function does.

    `fbvm explain dialects` says what compilers disagree about, and which answers --dialect chooses; `fbvm explain fault` which
    kinds of faults a network has, and their keys."""
    if code is None:
        for row in CODES.values():
            say(f"{row.code}  {row.severity:<7}  {row.title}")
        return
    if code.strip().lower() == "dialects":
        say(dialects.page())
        return
    if code.strip().lower() in ("fault", "faults"):
        from fbvm.run import fault_rows

        say(fault_rows.page())
        return
    if (instruction := instructions.find(code)) is not None:
        say(instructions.page(instruction))
        if (function := function_pages.page(code)) is not None:
            say(f"\n{function}")
        return
    if (block := block_pages.page(code)) is not None:
        say(block)
        return
    if (function := function_pages.page(code)) is not None:
        say(function)
        return
    try:
        say(page(code))
    except UnknownCode as error:
        raise click.UsageError(f"{_unknown(error)}\n`fbvm explain` alone lists all codes.") from None
    code = code.strip().upper()
    if CODES[code].severity == "warning":
        say(f"\nSwitch it off in a text with {{warning disable {code}}} .. {{warning restore {code}}}, or for a whole "
                   f"check with\n`fbvm check --no-warn {code}`.")
