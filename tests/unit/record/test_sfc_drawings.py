"""Drawings of charts whose branches meet again in part: arrows for what cannot be joined, lines that step aside, power in them.

The drawings were read by a person, element by element, beside the charts."""

from __future__ import annotations

import pytest
from test_sfc_text import BATCH

from fbvm.code.compiler import compile_text
from fbvm.code.image import SfcPicture
from fbvm.record.draw.sfc_text import ChartState, sfc_text

HEAD = "PROGRAM Main VAR a, b, c, d, e, f, g : BOOL; END_VAR "
SELECTION = """INITIAL_STEP S0: END_STEP STEP S1: END_STEP STEP S2: END_STEP STEP S3: END_STEP STEP S4: END_STEP
STEP S5: END_STEP
TRANSITION t1 FROM S0 TO S1 := a; END_TRANSITION TRANSITION t2 FROM S0 TO S2 := b; END_TRANSITION
TRANSITION t3 FROM S0 TO S3 := c; END_TRANSITION TRANSITION t4 FROM S1 TO S4 := d; END_TRANSITION
TRANSITION t5 FROM S2 TO S5 := e; END_TRANSITION TRANSITION t6 FROM S3 TO S4 := f; END_TRANSITION
TRANSITION t7 FROM S4 TO S5 := g; END_TRANSITION TRANSITION t8 FROM S5 TO S0 := TRUE; END_TRANSITION"""
SIMULTANEOUS = """INITIAL_STEP S0: END_STEP STEP S1: END_STEP STEP S2: END_STEP STEP S3: END_STEP STEP S4: END_STEP
STEP S5: END_STEP
TRANSITION FROM S0 TO (S1, S2, S3) := a; END_TRANSITION TRANSITION FROM (S1, S3) TO S4 := b; END_TRANSITION
TRANSITION FROM S2 TO S5 := c; END_TRANSITION TRANSITION FROM (S4, S5) TO S0 := d; END_TRANSITION"""
JUMPS = """INITIAL_STEP Start: END_STEP STEP S1: END_STEP STEP S2: END_STEP STEP S3: END_STEP STEP S4: END_STEP
TRANSITION FROM Start TO S1 := a; END_TRANSITION TRANSITION FROM Start TO S2 := b; END_TRANSITION
TRANSITION FROM Start TO S3 := c; END_TRANSITION TRANSITION FROM S1 TO S4 := d; END_TRANSITION
TRANSITION FROM S2 TO S4 := e; END_TRANSITION TRANSITION FROM S3 TO Start := f; END_TRANSITION
TRANSITION FROM S3 TO S4 := TRUE; END_TRANSITION TRANSITION FROM S4 TO (Start, S2) := a; END_TRANSITION"""
LEFT_WAY = """\
                  ╔══════╗
                  ║   S0 ║
                  ╚═══╤══╝
    ┏━━━━━━━━━━━━━━━━━┹───┬──────────────┐
    ┃                     │              │
   ╺╋╸ t1: a → TRUE      ╶┼╴ t2: b      ╶┼╴ t3: c
    ┃                     │              │
┌───┸──┐              ┌───┴──┐       ┌───┴──┐
│   S1 │              │   S2 │       │   S3 │
└───┰──┘              └───┬──┘       └───┬──┘
    ┃                     │              │
   ╺╋╸ t4: d → TRUE      ╶┼╴ t5: e      ╶┼╴ t6: f → FALSE
    ┃                     │              │
    ┃                     │              └► S4
    ┃                     │
┏━━━┻━━┓                  │
┃ ● S4 ┃                  │
┗━━━┯━━┛                  │
    │                     │
   ╶┼╴ t7: g              │
    │                     │
    └──────────┬──────────┘
           ┌───┴──┐
           │   S5 │
           └───┬──┘
               │
              ╶┼╴ t8: TRUE
               │
               └► S0
"""
RIGHT_WAYS = """\
                  ╔══════╗
                  ║   S0 ║
                  ╚═══╤══╝
    ┌──────────────┬──┺━━━━━━━━━━━━━━━━━━┓
    │              │                     ┃
   ╶┼╴ t1: a      ╶┼╴ t2: b             ╺╋╸ t3: c → TRUE
    │              │                     ┃
┌───┴──┐       ┌───┴──┐              ┌───┸──┐
│   S1 │       │   S2 │              │   S3 │
└───┬──┘       └───┰──┘              └───┰──┘
    │              ┃                     ┃
   ╶┼╴ t4: d      ╺╋╸ t5: e → TRUE      ╺╋╸ t6: f → TRUE
    │              ┃                     ┃
    │              ┃                     ┗► S4
    │              ┃
┏━━━┷━━┓           ┃
┃ ● S4 ┃           ┃
┗━━━┯━━┛           ┃
    │              ┃
   ╶┼╴ t7: g       ┃
    │              ┃
    └──────┲━━━━━━━┛
       ┌───┸──┐
       │   S5 │
       └───┬──┘
           │
          ╶┼╴ t8: TRUE
           │
           └► S0
"""
CUT_OFF = """\
             ╔══════╗
             ║   S0 ║
             ╚═══╤══╝
                 ┃
                ╺╋╸ a → TRUE
                 ┃
    ══╤══════════╪══════════╤══
  ┌───┸──┐   ┏━━━┻━━┓   ┌───┸──┐
  │   S1 │   ┃ ● S2 ┃   │   S3 │
  └───┰──┘   ┗━━━┯━━┛   └───┰──┘
      ┃          │          ┃
      ┃         ╶┼╴ c       ┃
      ┃          │          ┃
      ┃      ┌───┴──┐       ┃
      ┃      │   S5 │       ┃
      ┃      └───┬──┘       ┃
      ┃          │          ┗► t2
      ┃          └┐
    ══╪══ ◄ t2    │
      ┃           │
     ╺╋╸ b → TRUE │
      ┃           │
  ┏━━━┻━━┓        │
  ┃ ● S4 ┃        │
  ┗━━━┯━━┛        │
    ══╧═════╤═════╧══
            │
           ╶┼╴ d
            │
            └► S0
"""
STILL = """\
          ╔═══════╗
          ║ Start ║
          ╚═══╤═══╝
   ┌───────┬──┴──────────┐
   │       │             │
  ╶┼╴ a   ╶┼╴ b         ╶┼╴ c
   │       │             │
┌──┴─┐     │          ┌──┴─┐
│ S1 │     │          │ S3 │
└──┬─┘     │          └──┬─┘
   │       │       ┌─────┴─────┐
  ╶┼╴ d    │       │           │
   │       │      ╶┼╴ f       ╶┼╴ TRUE
   │       │       │           │
   │       │       └► Start    │
   │       │                   └► S4
   │       └─────┐
   └───┐         │
    ┌──┴─┐       │
    │ S4 │       │
    └──┬─┘       │
       │         │
      ╶┼╴ a      │
       │         │
══╤════╧═════╤══ │
  └► Start   │   │
             └─┬─┘
            ┌──┴─┐
            │ S2 │
            └──┬─┘
               │
              ╶┼╴ e
               │
               └► S4
"""
JUMPED = """\
             ╔═════════╗
             ║   Start ║
             ╚════╤════╝
    ┌───────┲━━━━━┹──────────────┐
    │       ┃                    │
   ╶┼╴ a   ╺╋╸ b → TRUE         ╶┼╴ c
    │       ┃                    │
┌───┴──┐    ┃                ┌───┴──┐
│   S1 │    ┃                │   S3 │
└───┬──┘    ┃                └───┰──┘
    │       ┃              ┌─────┺━━━━━┓
   ╶┼╴ d    ┃              │           ┃
    │       ┃             ╶┼╴ f       ╺╋╸ TRUE → TRUE
    │       ┃              │           ┃
    │       ┃              └► Start    ┃
    │       ┃                          ┗► S4
    │       ┗━━━━━━┓
    └──┐           ┃
   ┏━━━┷━━┓        ┃
   ┃ ● S4 ┃        ┃
   ┗━━━┳━━┛        ┃
       ┃           ┃
      ╺╋╸ a → TRUE ┃
       ┃           ┃
══╤════╧═════╤══   ┃
  ┗► Start   ┃     ┃
             ┗━━┳━━┛
            ┌───┸──┐
            │   S2 │
            └───┰──┘
                ┃
               ╺╋╸ e → TRUE
                ┃
                ┗► S4
"""
APART = """\
                ╔══════╗
                ║ Idle ║
                ╚═══╤══╝
                    │
                   ╶┼╴ t1
                    │
      ══╤═══════════╧═══════════╤══
   ┌────┴────┐  ┌───┬───────┐   └► Heating
   │ Filling ├──┤ N │ valve │
   └────┬────┘  └───┴───────┘
      ══╪══◄ done
        │
       ╶┼╴ (1) done
        │
  ┌─────┴────┐  ┌───┬──────┐
  │ Draining ├──┤ N │ pump │
  └─────┬────┘  └───┴──────┘
        │
       ╶┼╴ t3
        │
        └► Idle

┌─────────┐  ┌────────┬────────┬─────┐
│ Heating ├──┤ L T#5s │ heater │ hot │
└────┬────┘  ├────────┼────────┼─────┤
     │       │ P1     │ Count  │     │
     │       └────────┴────────┴─────┘
     └► done

t1: start
done: full AND hot
t3: empty
"""
APART_WITH_POWER = """\
                ╔════════╗
                ║   Idle ║
                ╚════╤═══╝
                     ┃
                    ╺╋╸ t1
                     ┃
       ══╤═══════════╧════════════╤══
   ┏━━━━━┻━━━━━┓  ┌───┬───────┐   ┗► Heating
   ┃ ● Filling ┠──┤ N │ valve │
   ┗━━━━━┳━━━━━┛  └───┴───────┘
       ══╪══◄ done
         ┃
        ╺╋╸ (1) done
         ┃
  ┌──────┸─────┐  ┌───┬──────┐
  │   Draining ├──┤ N │ pump │
  └──────┬─────┘  └───┴──────┘
         │
        ╶┼╴ t3
         │
         └► Idle

┏━━━━━━━━━━━┓  ┌────────┬────────┬─────┐
┃ ● Heating ┠──┤ L T#5s │ heater │ hot │
┗━━━━━┯━━━━━┛  ├────────┼────────┼─────┤
      │        │ P1     │ Count  │     │
      ╽        └────────┴────────┴─────┘
      ┗► done

t1: start → TRUE
done: full AND hot → TRUE
t3: empty
"""


def picture(chart: str) -> SfcPicture:
    image = compile_text(f"{HEAD}{chart} END_PROGRAM", lint=False).image
    assert image is not None
    return image.charts[0]


@pytest.mark.parametrize(("chart", "seen", "drawn"), [
    (SELECTION, ChartState(frozenset({4}), {0: True, 3: True, 5: False}), LEFT_WAY),
    (SELECTION, ChartState(frozenset({4}), {2: True, 4: True, 5: True}), RIGHT_WAYS),
    (SIMULTANEOUS, ChartState(frozenset({2, 4}), {0: True, 1: True}), CUT_OFF),
    (JUMPS, None, STILL),
    (JUMPS, ChartState(frozenset({4}), {1: True, 4: True, 6: True, 7: True}), JUMPED),
])  # fmt: skip
def test_branches_that_meet_in_part(chart: str, seen: ChartState | None, drawn: str) -> None:
    assert sfc_text(picture(chart), seen=seen) == drawn.splitlines()


@pytest.mark.parametrize(("seen", "drawn"), [
    (None, APART), (ChartState(frozenset({1, 2}), {0: True, 1: True}), APART_WITH_POWER)])  # fmt: skip
def test_a_branch_that_is_drawn_apart_leads_to_a_transition_by_an_arrow(seen: ChartState | None, drawn: str) -> None:
    image = compile_text(BATCH, lint=False).image
    assert image is not None
    assert sfc_text(image.charts[0], 30, seen) == drawn.splitlines()
