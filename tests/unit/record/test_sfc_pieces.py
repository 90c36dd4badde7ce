"""Pieces of drawings of charts alone: what they draw, how large they are, and where a line comes in."""

from __future__ import annotations

from typing import Any

import pytest

from fbvm.record.draw.sfc_pieces import Piece, arrow_target, join, jump, passing, stack, step, transition
from fbvm.syntax.ladder.drawing.box_lines import Surface


def drawn(piece: Piece) -> str:
    surface = Surface()
    piece.draw(surface, 0, 0)
    return "\n".join(surface.rows())


def size(piece: Piece) -> tuple[int, int, int]:
    return piece.width, piece.height, piece.entry


STEP = """\
┌──────┐
│ Fill │
└──────┘"""
ACTIVE = """\
┏━━━━━━┓  ┌───┬───────┐
┃ Fill ┠──┤ N │ Valve │
┗━━━┯━━┛  ├───┼───────┤
    │     │ S │ Pump  │
    ╵     └───┴───────┘"""
FIRST = """\
╔══════╗  ┌──────────┬───────┬──────┐
║ Fill ╟──┤ L, T#10s │ Valve │      │
╚═══╤══╝  ├──────────┼───────┼──────┤
    │     │ N        │ Pump  │ Busy │
    ╵     └──────────┴───────┴──────┘"""
ONE = """\
┌──────┐  ┌───┬───────┐
│ Fill ├──┤ N │ Valve │
└──────┘  └───┴───────┘"""


def test_a_step_is_a_box_with_its_actions_at_the_right() -> None:
    for drawing, wide, piece in (
            (STEP, (8, 3, 4), step("Fill", False, False, [])),
            (ONE, (23, 3, 4), step("Fill", False, False, [("N", "Valve", "")])),
            (ACTIVE, (23, 5, 4), step("Fill", False, True, [("N", "Valve", ""), ("S", "Pump", "")])),
            (FIRST, (37, 5, 4), step("Fill", True, True, [("L, T#10s", "Valve", ""), ("N", "Pump", "Busy")]))):  # fmt: skip
        assert (drawn(piece), size(piece)) == (drawing, wide)


def test_a_transition_is_a_bar_with_its_condition_in_lines() -> None:
    short, long = transition("a AND b", 20, False), transition("a AND b OR c AND NOT d OR e", 12, True)
    empty = transition("", 12, False)
    assert (drawn(short), size(short), short.thick) == (" ╷\n╶┼╴ a AND b\n ╵", (11, 3, 1), False)
    assert drawn(long) == " ╻\n╺╋╸ a AND b OR c\n ┃  AND NOT d OR\n ╹  e" and (size(long), long.thick) == ((16, 4, 1), True)
    assert (drawn(empty), size(empty)) == (" ╷\n╶┼╴\n ╵", (4, 3, 1))


def test_a_jump_names_its_steps_in_as_many_lines_as_it_takes() -> None:
    one, many = jump(["Fill"], False), jump(["Filling_of_A", "Filling_of_B", "Filling_of_C"], True)
    assert (drawn(one), size(one), one.thick) == ("╶► Fill", (7, 1, 0), False)
    assert (drawn(many), size(many), many.thick) == ("╺► Filling_of_A, Filling_of_B,\n   Filling_of_C", (30, 2, 0), True)


def node(name: str) -> Any:
    return name


def test_a_line_that_goes_on_has_an_end() -> None:
    piece = passing(node("A"), True)
    assert (size(piece), piece.thick, [(end.x, end.to, end.thick) for end in piece.ends]) == ((1, 0, 0), True, [(0, "A", True)])


def test_an_arrow_from_elsewhere_leads_to_a_transition_below_a_double_line() -> None:
    piece = arrow_target(transition("b", 20, True), "t2")
    assert drawn(piece) == "══╤══◄ t2\n  ┃\n ╺╋╸ b\n  ╹" and size(piece) == (9, 4, 2) and piece.thick


def way(name: str, fired: bool = False) -> Piece:
    return stack(transition(name, 20, fired), [passing(node("end"), fired)], False)


BRANCHES = """\
 ┌──────┐
 │ Fill │
 └───┰──┘
 ┌───┺━━━┓
 │       ┃
╶┼╴ a   ╺╋╸ b
 │       ┃
 ╵       ╹"""
AT_ONCE = """\
   ┌──────┐
   │ Fill │
   └───┬──┘
 ══╤═══╧═══╤══
   │       │
  ╶┼╴ a   ╶┼╴ b
   │       │
   ╵       ╵"""
MET = BRANCHES.rpartition("\n")[0] + """
 └───┲━━━┛
 ┌───┸──┐
 │ Next │
 └──────┘"""


def test_branches_stand_side_by_side_below_the_middle_and_meet_above_what_follows() -> None:
    fill = step("Fill", False, False, [])
    choice, both = stack(fill, [way("a"), way("b", True)], False), stack(fill, [way("a"), way("b")], True)
    assert stack(fill, [], False) is fill
    assert (drawn(choice), size(choice)) == (BRANCHES, (13, 7, 5)) and (drawn(both), size(both)) == (AT_ONCE, (15, 7, 7))
    assert [(end.x, end.thick) for end in choice.ends] == [(1, False), (9, True)]
    assert [(end.x, end.thick) for end in both.ends] == [(3, False), (11, False)]
    met = join(choice, node("end"), step("Next", False, False, []), False, "Next")
    assert (drawn(met), size(met), met.ends) == (MET, (13, 11, 5), [])


@pytest.mark.parametrize("shift", [0, 5])
def test_a_piece_is_drawn_where_it_is_put(shift: int) -> None:
    surface = Surface()
    step("Fill", False, False, []).draw(surface, shift, 2)
    assert surface.rows()[2:] == [" " * shift + row for row in STEP.splitlines()]
