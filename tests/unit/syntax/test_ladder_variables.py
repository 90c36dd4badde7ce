"""The variables that LADDERs need of their POU: their names say rung and step, and are the same wherever the POU stands."""

from __future__ import annotations

from fbvm.base.diagnostics import Source
from fbvm.syntax import tree
from fbvm.syntax.parser import parse

VARIABLES = "VAR a, b, c : BOOL; END_VAR"
LADDER = """
LADDER
@LD a
OUT b
LD b
@AND a
OUT c
END_LADDER
"""


def hidden(pou: tree.Pou) -> str:
    """The names of the variables that no program can name, in their order."""
    return " ".join(name.text for section in pou.sections if section.hidden for made in section.variables for name in made.names)


def pous(text: str) -> dict[str, str]:
    """What is hidden in each POU and method by its name."""
    read, said = parse(Source("x.st", text))
    assert not said
    found = [each for each in read.declarations if isinstance(each, tree.Pou)]
    return {pou.name.text: hidden(pou) for each in found for pou in (each, *each.methods)}


def test_rungs_of_a_pou_are_numbered_without_those_of_others() -> None:
    once, twice = "$1.0:was $2.1:was $1.1:on $2.2:on", "$1.0:was $2.1:was $3.0:was $4.1:was $1.1:on $2.2:on $3.1:on $4.2:on"
    assert pous(f"""
        PROGRAM First {VARIABLES}{LADDER}{LADDER}END_PROGRAM
        PROGRAM Second {VARIABLES}{LADDER}END_PROGRAM
        FUNCTION_BLOCK Block {VARIABLES}
        METHOD One {VARIABLES}{LADDER}END_METHOD
        METHOD Two {VARIABLES}{LADDER}END_METHOD
        {LADDER}END_FUNCTION_BLOCK
        PROGRAM Third {VARIABLES}{LADDER}
        ACTION Act:{LADDER}END_ACTION END_PROGRAM
        PROGRAM Fourth {VARIABLES}{LADDER}END_PROGRAM""") == {
        "First": twice, "Second": once, "Block": once, "One": once, "Two": once, "Third": twice, "Fourth": once}  # fmt: skip


def test_a_method_between_rungs_of_its_block_takes_none_of_their_names() -> None:
    found = pous(f"""
        FUNCTION_BLOCK Block {VARIABLES}{LADDER}
        METHOD One {VARIABLES}{LADDER}END_METHOD
        ACTION Act:{LADDER}END_ACTION END_FUNCTION_BLOCK""")
    assert found["Block"] == "$1.0:was $2.1:was $3.0:was $4.1:was $1.1:on $2.2:on $3.1:on $4.2:on"
    assert len(found["One"].split()) == 4


def test_rungs_behind_a_pou_are_numbered_on_from_its_own() -> None:
    found = pous(f"""
        PROGRAM First {VARIABLES}{LADDER}END_PROGRAM
        ACTION First.One:{LADDER}END_ACTION
        ACTIONS First ACTION Two:{LADDER}END_ACTION END_ACTIONS
        PROGRAM Second {VARIABLES}{LADDER}END_PROGRAM
        ACTION Act:{LADDER}END_ACTION""")
    own, behind = "$1.0:was $2.1:was $1.1:on $2.2:on", "$3.0:was $4.1:was"
    assert found == {"First": f"{own} {behind} $5.0:was $6.1:was $3.1:on $4.2:on $5.1:on $6.2:on",
                     "Second": f"{own} {behind} $3.1:on $4.2:on"}
