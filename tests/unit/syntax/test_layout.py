"""Pieces of text alone in the printer: what stands on one line, where the others begin; where bracket comments end."""

from __future__ import annotations

from rows import each_of

from fbvm.syntax.formatter.comments import Comments
from fbvm.syntax.formatter.layout import (
    BLANK,
    HARD,
    NOTHING,
    SPACE,
    Doc,
    Fill,
    Group,
    Hang,
    Indent,
    Leaf,
    Printer,
    Verbatim,
    flat_width,
)
from fbvm.syntax.st.comments import comment_end

NO_COMMENTS = Comments("", ())


def printed(*doc: Doc) -> list[str]:
    return Printer(NO_COMMENTS).print(doc).removesuffix("\n").split("\n")


def lengths(*doc: Doc) -> list[int]:
    return [len(line) for line in printed(*doc)]


def x(count: int) -> str:
    return "x" * count


ROOM: list[tuple[tuple[Doc, ...], list[int]]] = [
    ((Group((x(60), SPACE, x(39))),), [100]), ((Group((x(60), SPACE, x(40))),), [60, 40]),
    ((Group((x(60), NOTHING, x(40))),), [100]), ((Group((x(60), NOTHING, x(41))),), [60, 41]),
    ((Group((Leaf(x(60), 0, 1), SPACE, Leaf(x(39), 2, 3))),), [100]), ((Group((x(60), SPACE, Leaf(x(40), 2, 3))),), [60, 40]),
    ((Group((x(60), SPACE, x(38))), ";"), [100]), ((Group((x(60), SPACE, x(39))), ";"), [60, 40]),
    ((Group((x(60), SPACE, x(39))), SPACE, "y"), [100, 1]), ((Group((x(60), SPACE, x(39))), HARD, "y"), [100, 1]),
    ((Group((x(60), SPACE, x(39))), BLANK, "y"), [100, 0, 1]), ((Group(("a", HARD, "b", SPACE, "c")),), [1, 1, 1]),
    ((Group((x(20), SPACE, Group((x(40), SPACE, x(38))))),), [100]),
    ((Group((x(20), SPACE, Group((x(40), SPACE, x(39))))),), [20, 80]),
    ((Group((x(20), SPACE, Group((x(60), SPACE, x(41))))),), [20, 60, 41]),
    ((Fill((x(49), x(50), "y")), ";"), [100, 2]), ((Fill((x(49), x(51), "y")),), [49, 53]),
    ((Fill((x(49), x(49))), ";"), [100]), ((Fill((x(49), x(50))), ";"), [49, 51]), ((Fill((x(9),) * 12),), [99, 19]),
    ((Group(("[", Fill((x(48), x(48))), SPACE, "z")),), [100]), ((Group(("[", Fill((x(48), x(49))), SPACE, "z")),), [99, 1]),
    ((Group((x(60), SPACE, x(37))), Fill(("y", "z"))), [99, 1]), ((Group((x(60), SPACE, x(39))), Fill(("yy", "z"))), [60, 43]),
]  # fmt: skip


@each_of(("doc", "wanted"), ROOM)
def test_a_line_has_a_hundred_columns(doc: tuple[Doc, ...], wanted: list[int]) -> None:
    assert lengths(*doc) == wanted


def test_further_lines_begin_further_in_or_below_the_first_character() -> None:
    pair = Group((x(60), SPACE, "y" * 60))
    assert printed(Indent(pair)) == [x(60), "    " + "y" * 60]
    assert printed("abc := ", Hang(pair)) == [f"abc := {x(60)}", "       " + "y" * 60]
    assert printed(Indent((HARD, "a", Indent((HARD, "b")))), HARD, "c") == ["    a", "        b", "c"]
    assert printed("    a", HARD, "b") == ["a", "b"], "nothing stands in front of a line but its indentation"


def test_what_hangs_far_to_the_right_begins_on_a_line_of_its_own_if_a_part_has_no_room() -> None:
    pair, filled = Hang(Group((x(30), SPACE, "y" * 30))), Hang(Fill((x(30), "y" * 30)))
    for hanging in (pair, filled):
        assert printed("a" * 39, hanging) == ["a" * 39 + f"{x(30)} {'y' * 30}"]
        for column in (41, 70):
            assert printed("a" * column, hanging) == ["a" * column + x(30), " " * column + "y" * 30]
        assert printed("a" * 71, hanging) == ["a" * 71, f"        {x(30)} {'y' * 30}"]
    wide = Hang(Group((x(70), SPACE, "y" * 70)))
    assert printed("a" * 40, wide) == ["a" * 40 + x(70), " " * 40 + "y" * 70], "up to this column a text hangs in any case"
    assert printed("a" * 41, wide) == ["a" * 41, f"        {x(70)}", "        " + "y" * 70]


def test_text_that_is_kept_is_shifted_as_a_whole() -> None:
    assert printed(Indent((HARD, Verbatim("a\n    b\n  c\n\nd", 2)))) == ["    a", "      b", "    c", "", "  d"]


@each_of(("doc", "width"), [
    ("abc", 3), (("a", SPACE, "b"), 3), (Group((Indent("ab"), NOTHING, Hang("c"))), 3), (Fill(("a", "b", "c")), 5), (Fill(()), 0),
    (Leaf("ab", 0, 2), 2), (("a", HARD), None), (Verbatim("a", 0), None), ((), 0),
])  # fmt: skip
def test_the_width_of_a_piece_on_one_line(doc: Doc, width: int | None) -> None:
    assert flat_width(doc, NO_COMMENTS) == width


@each_of(("text", "end", "inner"), [
    ("(*a*) b", 5, 0), ("(*a (*b*) c*) d", 13, 4), ("(*a (*b*) c", 9, 4), ("(*a", -1, 0), ("(*a /*b*/*)", 11, 0), ("(*)*)", 5, 0),
    ("/*a /*b*/ c*/ d", 13, 4), ("/*a*/", 5, 0), ("/*a (*b*) */", 12, 0), ("(*(*(**)*)*) d", 12, 2), ("(*a*) (*b*)", 5, 0),
])  # fmt: skip
def test_bracket_comments_nest_if_they_are_closed_as_often_as_opened(text: str, end: int, inner: int) -> None:
    assert comment_end(text, 0) == (end, inner)
