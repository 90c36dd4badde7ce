"""The rules of the ETN21 for proofs: every run of the emulated unit keeps them, and each of them says something."""

from __future__ import annotations

import pytest
from common_unit_tests import answer, events
from depth import times
from etn21_rig import CIO, D, Rig
from hypothesis import given, settings
from hypothesis import strategies as st
from rows import each_of

from fbvm import Plc, compile_text
from fbvm.machine.plc import Phase
from fbvm.prove.encoding.terms import Terms
from fbvm.prove.unit_rules import KINDS, MOST_BYTES, Rule, Watch, Word, free_words, offset_of, rules
from fbvm.units.etn21.map import Switch
from fbvm.units.etn21.unit import Etn21, Fault
from fbvm.wire.link import Event, Peer, Request, Sent

SOCKETS = (1, 2)
SETTLED = 20
"""Cycles after which an open is over, with all words out of step."""
parameters = st.fixed_dictionaries({
    "option": st.integers(0, 3), "local_port": st.sampled_from([0, 502, 3000]), "count": st.sampled_from([0, 1, 12, 1984, 1985]),
    "remote": st.builds(Peer, st.sampled_from(["0.0.0.0", "192.168.250.7"]), st.sampled_from([0, 502])),
    "address": st.sampled_from([(D, 1000, 0), (CIO, 100, 0), (0x30, 0, 0), (D, 1000, 7)]),
    "timeout": st.sampled_from([0, 1, 100]),
})  # fmt: skip
possible = events(st.integers(1, 2)).filter(lambda event: not isinstance(event, Sent) or event.size <= MOST_BYTES)
"""No network has taken more bytes than a unit can send."""
turns = st.tuples(st.sampled_from(SOCKETS), st.sampled_from(Switch), parameters)
cycles = st.tuples(st.lists(turns, max_size=2), st.lists(possible, max_size=2), st.booleans(),
                   st.sampled_from([10, 10, 10, 200, 80_000]))  # fmt: skip


def words_of(rig: Rig, some: tuple[Rule, ...]) -> dict[Word, int]:
    return {word: rig.memory.words(word[0])[word[1]] for rule in some for word in rule.words}


def broken(some: tuple[Rule, ...], before: dict[Word, int], after: dict[Word, int]) -> list[Rule]:
    terms = Terms()
    old, new = ({word: terms.constant(16, value) for word, value in values.items()} for values in (before, after))
    return [rule for rule in some if rule.term(terms, old, new) is not terms.true]


@pytest.mark.slow
@settings(max_examples=times(100), deadline=None)
@given(st.lists(cycles, max_size=25), st.sampled_from(["exact", "real"]), st.integers(0, 9), st.booleans())
def test_every_run_of_the_emulated_unit_keeps_the_rules(
    script: list[tuple[list[tuple[int, Switch, dict[str, object]]], list[Event], bool, int]], timing: str, seed: int,
    is_open: bool,
) -> None:
    faults = [] if is_open else [Fault(0x2211, Switch.SEND), Fault(0x0302, socket=2)]
    rig = Rig(Etn21(timing=timing, seed=seed, faults=faults))
    asked: list[Request] = []
    if is_open:
        rig.parameters()
        replies = answer(rig.scan(Switch.ACTIVE_OPEN))
        for _ in range(SETTLED):
            replies = answer(rig.scan(*replies))
        assert rig.is_open()
    some = tuple(rule for socket in SOCKETS for rule in rules(0, socket))
    for program, told, is_answered, cycle_ms in script:
        for socket, switch, values in program:
            rig.parameters(socket, socket, **values)  # type: ignore[arg-type]
            rig.turn_on(switch, socket)
        before = words_of(rig, some)
        replies = answer(asked) if is_answered else []
        rig.cycle_ns = cycle_ms * 1_000_000
        asked = rig.scan(*told, *replies) if is_answered else [*asked, *rig.scan(*told)]
        assert broken(some, before, words_of(rig, some)) == []


UDP, STATUS, SWITCHES, STATE, CODE = ("CIO", 1501), ("CIO", 1509), ("CIO", 1519), ("D", 30009), ("D", 30027)
WRONG = [
    ("only clears", SWITCHES, 0, 1), ("stays off", STATUS, 0, 0x10), ("at most", STATE, 0, 0xB), ("keeps", ("D", 30018), 1, 2),
    ("becomes at most", ("D", 30023), 1985, 1986),
    ("rises while", STATUS, 0, 1), ("changes while", CODE, 0xFFFF, 0),
    ("becomes one of", CODE, 0, 0x1234), ("one at most", STATUS, 0, 0x6), ("one at most", STATUS, 1, 3),
    ("stays off", UDP, 0, 0x2000), ("rises while", UDP, 0, 1), ("one at most", UDP, 0, 6),
]  # fmt: skip


def test_the_switch_of_one_protocol_opens_no_socket_of_the_other() -> None:
    some = rules(0, 1)
    for switch, status in ((Switch.UDP_OPEN, STATUS), (Switch.ACTIVE_OPEN, UDP)):
        before = {word: 0 for rule in some for word in rule.words} | {SWITCHES: 1 << switch}
        other = UDP if status == STATUS else STATUS
        assert broken(some, before, before | {other: 1}) == []
        assert {rule.kind for rule in broken(some, before, before | {status: 1})} == {"rises while"}


@pytest.mark.parametrize(("kind", "word", "old", "new"), WRONG)
def test_a_unit_that_does_otherwise_breaks_a_rule(kind: str, word: Word, old: int, new: int) -> None:
    some = rules(0, 1)
    before = {word: 0 for rule in some for word in rule.words} | {word: old}
    assert broken(some, before, before) == []
    assert kind in {rule.kind for rule in broken(some, before, before | {word: new})}


KEPT = [
    ("CIO 1570", "only clears", 0xFF), ("CIO 1561", "stays off", 0x1FF0), ("D 30211", "at most", 0xA),
    ("D 30203", "at most", 1984), ("D 30243", "becomes at most", 1984),
    ("D 30247", "changes while", 0, "CIO 1570: 3F", "CIO 1561: F"),
    ("D 30247", "becomes one of", 0), ("CIO 1561", "one at most", 7), ("D 30238", "keeps", 0xFFFF), ("D 30244", "keeps", 0xFFFF),
    ("D 30245", "keeps", 0xFFFF), ("D 30246", "keeps", 0xFFFF), ("CIO 1553", "stays off", 0x3FF0), ("CIO 1553", "one at most", 7),
    ("CIO 1561", "rises while", 1, "CIO 1570: 6"), ("CIO 1561", "rises while", 2, "CIO 1570: 10"),
    ("CIO 1561", "rises while", 4, "CIO 1570: 8"), ("CIO 1561", "rises while", 8, "CIO 1570: 20"),
    ("CIO 1553", "rises while", 1, "CIO 1570: 1"), ("CIO 1553", "rises while", 2, "CIO 1570: 10"),
    ("CIO 1553", "rises while", 4, "CIO 1570: 8"), ("CIO 1553", "rises while", 8, "CIO 1570: 20"),
]  # fmt: skip
"""The rules of socket 3 of unit 2, by hand from W421 6-6-2 to 6-7-6: n is 1550, m 30200, its area begins at m+38."""


def test_the_words_of_a_socket_and_their_rules() -> None:
    found = [(f"{rule.word[0]} {rule.word[1]}", rule.kind, rule.number,
              *(f"{area} {word}: {mask:X}" for (area, word), mask in rule.cause)) for rule in rules(2, 3)]  # fmt: skip
    assert found == KEPT
    assert list(free_words(rules(2, 3))) == ["CIO1570.00..1570.07", *dict.fromkeys(
        name.replace(" ", "") for name, *_ in KEPT if name != "CIO 1570")]
    assert next(iter(free_words(rules(2, 4)))) == "CIO1570.08..1570.15"


def test_every_kind_of_rule_has_a_source_and_is_used() -> None:
    assert {rule.kind for rule in rules(15, 8)} == set(KINDS) == {kind for kind, *_ in WRONG}
    assert all(rule.source.startswith(("W420", "W421")) for rule in rules(15, 8))
    with pytest.raises(ValueError, match="socket 9"):
        rules(0, 9)


@each_of("phase, kept", [(None, True), (Phase.INPUTS, True), (Phase.PROGRAM, False), (Phase.REFRESH, False)])
def test_what_a_run_writes_behind_its_program_has_to_keep_the_rules(phase: Phase | None, kept: bool) -> None:
    plc = Plc(compile_text("PROGRAM Main VAR n AT %D100 : UINT; END_VAR n := n + 1; END_PROGRAM").image, engine="python")
    watch = Watch(plc, (Rule(("D", 100), "keeps", 0xFFFF, "here"), Rule(("D", 200), "at most", 9, "here")))
    plc.phases += [watch.phase, lambda plc, over: plc.write("D100", 50) if over is phase else None]
    plc.run(scans=3)
    assert watch.is_kept == kept


def test_a_write_is_judged_by_the_rules_of_its_word() -> None:
    plc = Plc(compile_text("PROGRAM Main VAR n : UINT; END_VAR n := n + 1; END_PROGRAM").image, engine="python")
    watch = Watch(plc, (Rule(("D", 100), "keeps", 0xFF00, "here"), Rule(("D", 200), "at most", 9, "here")))
    at, other = offset_of(("D", 100)), offset_of(("D", 200))
    for wrong, allowed in (("D100", [False, False, True, True]), ("D200", [True, True, False, False])):
        for value, expected in ((7, [True] * 4), (0x107, allowed), (0, [True] * 4)):
            plc.write(wrong, value)
            assert [watch.allows(plc, offset) for offset in (at, at + 1, other, other + 1)] == expected
    assert watch.allows(plc, at - 1) and watch.allows(plc, at + 2)
