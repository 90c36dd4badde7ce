"""The branches of IF and CASE: the first statement of each, and whether none of them may be executed."""

from __future__ import annotations

from fbvm.code.compiler import compile_text
from fbvm.record.trace.branches import branches, statements

TEXT = """PROGRAM Main VAR a, b, c, n : INT; END_VAR
IF a > 0 THEN
    n := 1;
ELSIF b > 0 THEN
    IF c > 0 THEN n := 2; ELSE n := 3; END_IF
ELSE
    ;
END_IF
CASE a OF
    1: n := 4;
    2: n := 5;
    ELSE n := 6;
END_CASE
FOR c := 1 TO 3 DO IF b = c THEN n := 7; END_IF END_FOR
WHILE a > 3 DO a := a - 1; END_WHILE
CASE b OF 1: n := 8; END_CASE
END_PROGRAM
"""


def test_each_if_and_case_has_its_branches_and_says_whether_it_may_take_none() -> None:
    """An empty ELSE takes no statement; loops are no branches, but what stands in them has some."""
    image = compile_text(TEXT, lint=False).image
    assert image is not None
    line = {number: site.line for number, site in enumerate(image.sites)}
    assert [(line[each.site], [line[target] for target in each.targets], each.may_skip) for each in branches(image)] == [
        (2, [3, 5], True), (5, [5, 5], False), (9, [10, 11, 12], False), (14, [14], True), (16, [16], True)]
    assert [line[site] for site in statements(image)] == [2, 3, 5, 5, 5, 9, 10, 11, 12, 14, 14, 14, 15, 15, 16, 16]
