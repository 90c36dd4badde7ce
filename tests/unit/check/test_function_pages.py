"""`fbvm explain LIMIT`: every standard function has a page."""

from __future__ import annotations

import pytest
from click.testing import CliRunner

from fbvm.check import function_pages
from fbvm.check.calls.functions import OPERATORS, SIGNATURES, TIME_OPERATORS
from fbvm.cli.main import main


def explained(name: str) -> str:
    result = CliRunner().invoke(main, ["explain", name])
    assert result.exit_code == 0, result.output
    return result.output


def test_every_standard_function_has_a_page_and_every_meaning_a_function() -> None:
    public = {name for name in SIGNATURES if not name.startswith("__")}
    assert public | set(OPERATORS) == set(function_pages.MEANINGS)
    for name in [*public, *OPERATORS, *TIME_OPERATORS]:
        page = function_pages.page(name)
        assert page and page.startswith(f"# {name}\n") and f"FUNCTION {name}" in page, name


def test_a_page_has_meaning_parameters_and_types() -> None:
    assert explained("limit") == (
        "# LIMIT\n\nIN, but at least MN and at most MX.\n\n```st\nFUNCTION LIMIT : T\nVAR_INPUT\n    MN : T;\n    IN : T;\n"
        "    MX : T;\nEND_VAR\n```\n\nT is one type for all of them: ANY_ELEMENTARY.\n\nStandard function (IEC 61131-3)\n")


@pytest.mark.parametrize(("name", "said"), [
    ("DINT_TO_INT", "Conversion from DINT: it converts a value to INT;"), ("TO_LREAL", "IN : ANY_ELEMENTARY;"),
    ("REAL_TRUNC_INT", "cuts its fraction off"), ("WORD_BCD_TO_UINT", "four bits each, to UINT"),
    ("UINT_TO_BCD", "FUNCTION UINT_TO_BCD : WORD"),
    ("ADD_DT_TIME", "IN1 : DT;"), ("MAX_INT", "MAX of values of type INT"), ("FIND", "CODESYS calls its inputs STR1, STR2"),
    ("MUX", "may be there several times"), ("XOR", "an odd number of inputs"),
])  # fmt: skip
def test_conversions_and_typed_functions_have_one(name: str, said: str) -> None:
    assert said in explained(name)


def test_a_word_of_ladder_that_is_a_function_has_both() -> None:
    page = explained("AND")
    assert page.startswith("AND\n\nJoins a bit in series.") and "The bits that are set in all inputs." in page


def test_what_is_no_function_has_none() -> None:
    assert function_pages.page("__DUE") is None and function_pages.page("LIMITS") is None
    assert CliRunner().invoke(main, ["explain", "LIMITS"]).exit_code == 2
