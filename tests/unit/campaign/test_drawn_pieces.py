"""Changes of drawn rungs: where a piece takes its room from, and which marks are taken for one another."""

from __future__ import annotations

import pytest

from fbvm.campaign.mutation.drawn import WIRE, fitted, mark, marks, operand

FITTED = {
    # text, from, to, new, filler: the text afterwards; None if there is no room
    ("a-bc", 0, 1, "x", "-"): "x-bc", ("a--b", 0, 1, "xy", "-"): "xy-b", ("a-b", 0, 1, "xy", "-"): None,
    ("--a|b", 2, 3, "xy", "-"): "-xy|b", ("-a|b", 1, 2, "xy", "-"): None, ("---a|b", 3, 4, "xyz", "-"): "-xyz|b",
    ("--a|b", 2, 3, "xyz", "-"): None, ("-.--a|b", 4, 5, "xyz", "-"): None, ("a-.-b", 0, 1, "xyz", "-"): None,
    ("aaa-b", 0, 3, "x", "-"): "x---b", ("|aaa|-", 1, 4, "x", "-"): "|x--|-", ("-aaa|", 1, 4, "x", "-"): "-x--|",
    ("aaa─b", 0, 3, "x", "-─"): "x───b", ("a   \nb", 0, 1, "xyz", "-"): "xyz \nb", ("a\nb", 0, 1, "xyz", "-"): "xyz\nb",
    ("a \r\nb", 0, 1, "xyz", " "): "xyz\r\nb", ("a--", 0, 1, "xyz", "-"): None, ("--a|", 2, 3, "xyz", "-"): None,
    ("a", 0, 1, "xyz", "-"): "xyz", ("a一-b", 0, 2, "xyz", "-"): "xyz-b",
}  # fmt: skip


def applied(text: str, piece: tuple[int, int, str] | None) -> str | None:
    return None if piece is None else text[:piece[0]] + piece[2] + text[piece[1]:]


def test_a_piece_takes_its_room_from_what_fills_the_drawing_and_leaves_one_of_it() -> None:
    """What is shorter is filled up; what is longer takes room behind it, else before it; at the end of a line there is enough."""
    assert {key: applied(key[0], fitted(*key)) for key in FITTED} == FITTED


OPERANDS = [
    # text, places of the operands, number of one, element, new operand: the text afterwards
    ("--[ Go ]--", [(4, 6)], 0, (2, 8), "Run", "--[ Run ]-"), ("--[>n m]-", [(4, 5)], 0, (2, 8), "n2", "-[>n2 m]-"),
    ("n &9  |\n┤>├", [(0, 1), (2, 4)], 0, (8, 11), "m2", "m2 &9 |\n┤>├"),
    ("n &9  |\n┤>├", [(0, 1), (2, 4)], 0, (8, 11), "Full", None),
    ("n &9  |\n┤>├", [(0, 1), (2, 4)], 1, (8, 11), "&10", "n &10 |\n┤>├"),
    ("n &9  |\n┤>├", [(0, 1), (2, 4)], 1, (8, 11), "&99", "n &99 |\n┤>├"),
    ("┌─ t : TON ──┐", [(3, 4)], 0, (0, 14), "la", "┌─ la : TON ─┐"), ("┌─ t : TON ─┐", [(3, 4)], 0, (0, 13), "la", None),
    ("┌─ t :TON  ────┐", [(3, 4)], 0, (0, 16), "late", "┌─ late :TON  ─┐"),
    ("   n─┤IN", [(3, 4)], 0, (0, 4), "ab", "  ab─┤IN"), ("   n─┤IN", [(3, 4)], 0, (0, 4), "late", None),
    ("   n ─┤IN", [(3, 4)], 0, (0, 4), "ab", "  ab ─┤IN"), ("  nm┤IN", [(2, 4)], 0, (0, 4), "x", "   x┤IN"),
    ("│ n      |", [(2, 3)], 0, (0, 9), "late", "│ late   |"), ("│n|", [(1, 2)], 0, (0, 1), "late", None),
    ("│ nm  |", [(2, 4)], 0, (0, 1), "x", "│ x   |"),
]  # fmt: skip


def test_an_operand_stays_where_its_element_is() -> None:
    """In a contact, above a comparison, in the head of a box, at its left, where it ends at the pin, and within it."""
    for text, places, number, element, new, said in OPERANDS:
        assert applied(text, operand(text, places, number, element, new)) == said, (text, new)


MARKS = {
    ("┤ ├", ""): ["CONTACT /"], ("┤/├", ""): ["CONTACT "], ("┤P├", ""): ["CONTACT N", "EDGE "],
    ("┤↑├", ""): ["CONTACT ↓", "EDGE "],
    ("┤/P├", ""): ["CONTACT P", "CONTACT /N", "EDGE /"], ("┤!/├", ""): ["CONTACT !"], ("┤@├", ""): ["CONTACT @/"],
    ("[/Go]", "Go"): ["CONTACT "], ("[N Go]", "Go"): ["CONTACT P", "EDGE "], ("( )", ""): ["COIL /"], ("(/)", ""): ["COIL "],
    ("(S)", ""): ["COIL "], ("(R)", ""): ["COIL S"], ("(SET)", ""): ["COIL "], ("(RSET)", ""): ["COIL SET"],
    ("(P)", ""): ["COIL N"],
    ("(!R a)", "a"): ["COIL !S"], ("(/P)", ""): [], ("┤>├", ""): [],
}  # fmt: skip


def test_marks_are_taken_for_their_relatives() -> None:
    found = {key: [" ".join(pair) for pair in marks(*key)] for key in MARKS}
    assert found == MARKS


@pytest.mark.parametrize(("text", "inside", "new", "said"), [
    ("--[ ]--", "", "/", "--[/]--"), ("--[P]--", "", "", "--[ ]--"), ("--( R )--", "", "S", "--( S )--"),
    ("--[Go]-----", "Go", "/", "--[/Go ]---"), ("--[/Go]--", "Go", "", "--[ Go ]-"), ("--(R Go)----", "Go", "S", "--(S Go )---"),
    ("│[P]│", "", "RSET", None),
])  # fmt: skip
def test_a_mark_stands_in_the_middle_or_in_front_of_its_operand(text: str, inside: str, new: str, said: str | None) -> None:
    first, last = min(at for at in range(len(text)) if text[at] in "[("), max(at for at in range(len(text)) if text[at] in "])")
    assert applied(text, mark(text, (first, last + 1), inside, new)) == said
    assert set(WIRE) >= {"-", "─"}
