"""Tests that every unit passes: inherit `CommonUnitTests` and say how to build the unit and how to ask it."""

from __future__ import annotations

import json
from array import array
from collections.abc import Iterator, Sequence

import pytest
from depth import times
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fbvm.units.contract import Unit
from fbvm.wire.link import (
    Broken,
    Close,
    Closed,
    Connect,
    Event,
    Failed,
    Opened,
    Peer,
    PeerClosed,
    Received,
    Request,
    Send,
    SendTo,
    Sent,
)

CYCLE_NS = 10_000_000
PEER = Peer("192.168.250.7", 502)


SIZES = {"CIO": 6144, "W": 512, "H": 1536, "A": 960, "D": 32768, "E0": 32768, "E2": 32768, "NOC": 13664,
         "TXP": 12808}


class FakeMemory:
    """Areas as a PLC with two E banks and mailboxes has them."""

    def __init__(self) -> None:
        self._areas = {name: memoryview(array("H", bytes(2 * size))) for name, size in SIZES.items()}

    def words(self, area: str) -> memoryview:
        return self._areas[area]

    def snapshot(self) -> dict[str, bytes]:
        return {name: words.tobytes() for name, words in self._areas.items()}

    def differences(self, before: dict[str, bytes]) -> Iterator[tuple[str, int]]:
        """The words that are no longer as in a snapshot."""
        for name, words in self._areas.items():
            if words.tobytes() != before[name]:
                old = memoryview(before[name]).cast("H")
                yield from ((name, at) for at in range(len(words)) if words[at] != old[at])


def events(channels: st.SearchStrategy[int]) -> st.SearchStrategy[Event]:
    """Any event that a network, also a confused one, may tell."""
    sizes = st.integers(0, 3000)
    data = sizes.map(bytes)
    peers = st.builds(Peer, st.sampled_from(["192.168.250.7", "10.0.0.255", "0.0.0.0"]), st.integers(0, 65535))
    errors = st.sampled_from(["ECONNREFUSED", "ECONNRESET", "ETIMEDOUT", "EPIPE", "ENOBUFS", "EUNHEARDOF"])
    return st.one_of(
        st.builds(Opened, channels, st.integers(1, 65535), peers),
        st.builds(Failed, channels, st.sampled_from(["open", "send"]), errors),
        st.builds(Sent, channels, sizes),
        st.builds(Received, channels, data, peers),
        st.builds(PeerClosed, channels),
        st.builds(Broken, channels, errors),
        st.builds(Closed, channels),
    )


def answer(requests: Sequence[Request]) -> list[Event]:
    """What a network says where everything works."""
    told: list[Event] = []
    for request in requests:
        if isinstance(request, Connect):
            told.append(Opened(request.channel, request.local_port or 49152, request.remote))
        elif isinstance(request, Send | SendTo):
            told.append(Sent(request.channel, len(request.data)))
        elif isinstance(request, Close):
            told.append(Closed(request.channel))
    return told


class CommonUnitTests:
    """What a unit owes to the machine, whatever it is."""

    inherited = settings(
        max_examples=times(40), deadline=None, suppress_health_check=[HealthCheck.differing_executors, HealthCheck.too_slow]
    )

    sizes = SIZES
    """Words of the areas that there are; a unit with a mailbox of its own adds it."""

    # --- what a unit's tests say of it -------------------------------------------------------------------------------

    def new_unit(self) -> Unit:
        """The unit under test."""
        raise NotImplementedError

    def may_write(self) -> set[tuple[str, int]]:
        """Every word that the unit may ever change, but for received data (`data_words`)."""
        raise NotImplementedError

    def data_words(self) -> set[tuple[str, int]]:
        """Where `ask` lets received data go."""
        raise NotImplementedError

    def ask(self, memory: FakeMemory) -> None:
        """Do as a program does that wants the unit to make one request of the network."""
        raise NotImplementedError

    def is_answered(self, memory: FakeMemory) -> bool:
        """True if the program can see that what it asked for has ended well."""
        raise NotImplementedError

    # --- the tests ---------------------------------------------------------------------------------------------------

    def fresh(self) -> tuple[Unit, FakeMemory]:
        unit, memory = self.new_unit(), FakeMemory()
        assert unit.reset(memory) == []
        return unit, memory

    def test_has_a_name_and_an_address(self) -> None:
        unit = self.new_unit()
        assert unit.name and unit.changed_words is False
        assert len(unit.address.split(".")) == 4

    def test_says_how_it_was_made_and_set(self) -> None:
        """As plain data, by which a journal builds the same unit again."""
        unit = self.new_unit()
        made, was_set = json.loads(json.dumps([unit.configuration, unit.settings]))
        twin = type(unit)(**made)
        twin.settings = was_set
        assert (twin.name, twin.address) == (unit.name, unit.address)
        assert (twin.configuration, twin.settings) == (unit.configuration, unit.settings)

    def test_silent_after_reset(self) -> None:
        unit, memory = self.fresh()
        before = memory.snapshot()
        assert [unit.refresh(memory, [], scan * CYCLE_NS) for scan in range(20)] == [[]] * 20
        assert list(memory.differences(before)) == []

    def test_reset_writes_only_its_own_words(self) -> None:
        unit, memory = self.new_unit(), FakeMemory()
        for area in SIZES:
            words = memory.words(area)
            words[:] = memoryview(array("H", [0xFFFF] * len(words)))
        before = memory.snapshot()
        unit.reset(memory)
        assert set(memory.differences(before)) <= self.may_write()

    def test_one_answer_to_one_request(self) -> None:
        unit, memory = self.fresh()
        self.ask(memory)
        asked = unit.refresh(memory, [], CYCLE_NS)
        assert len(asked) == 1
        waiting = [unit.refresh(memory, [], scan * CYCLE_NS) for scan in range(2, 8)]
        assert waiting == [[]] * 6
        assert not self.is_answered(memory)
        unit.refresh(memory, answer(asked), 8 * CYCLE_NS)
        assert self.is_answered(memory)
        after = memory.snapshot()
        later = [unit.refresh(memory, [], scan * CYCLE_NS) for scan in range(9, 20)]
        assert later == [[]] * 11
        assert list(memory.differences(after)) == []

    def test_reset_ends_what_is_open(self) -> None:
        unit, memory = self.fresh()
        self.ask(memory)
        asked = unit.refresh(memory, [], CYCLE_NS)
        unit.refresh(memory, answer(asked), 2 * CYCLE_NS)
        requests = unit.reset(memory)
        assert {type(request) for request in requests} == {Close}
        assert unit.reset(memory) == []
        assert unit.refresh(memory, answer(requests), 3 * CYCLE_NS) == []

    def test_works_again_after_a_reset(self) -> None:
        unit, memory = self.fresh()
        self.ask(memory)
        unit.refresh(memory, [], CYCLE_NS)
        closes = unit.reset(memory)
        self.ask(memory)
        asked = unit.refresh(memory, answer(closes), 2 * CYCLE_NS)
        assert len(asked) == 1
        unit.refresh(memory, answer(asked), 3 * CYCLE_NS)
        assert self.is_answered(memory)

    @pytest.mark.slow
    @inherited
    @given(st.lists(st.lists(events(st.integers(-1, 20)), max_size=4), max_size=12), st.data())
    def test_any_order_of_events_is_survived(self, scans: list[list[Event]], data: st.DataObject) -> None:
        unit, memory = self.fresh()
        before = memory.snapshot()
        for number, told in enumerate(scans):
            if data.draw(st.booleans()):
                self.ask(memory)
                before = memory.snapshot()
            unit.refresh(memory, told, number * CYCLE_NS)
            assert set(memory.differences(before)) <= self.may_write() | self.data_words()
            before = memory.snapshot()

    def test_wakes_the_program_when_it_has_news(self) -> None:
        """Nobody scans without need, and nobody sleeps while the program has something to see."""
        unit, memory = self.fresh()
        unit.refresh(memory, [], CYCLE_NS)
        assert unit.wake_ns > CYCLE_NS << 10
        self.ask(memory)
        told = answer(unit.refresh(memory, [], 2 * CYCLE_NS))
        assert unit.changed_words  # what it shows of the request
        unit.refresh(memory, [], 3 * CYCLE_NS)
        assert unit.wake_ns > 3 * CYCLE_NS and not unit.changed_words
        unit.refresh(memory, told, 4 * CYCLE_NS)
        assert unit.changed_words

    @pytest.mark.slow
    @inherited
    @given(st.lists(st.lists(events(st.integers(0, 3)), max_size=4), max_size=12))
    def test_nothing_happens_before_its_time(self, scans: list[list[Event]]) -> None:
        unit, memory = self.fresh()
        now_ns = CYCLE_NS
        for told in scans:
            self.ask(memory)
            before = memory.snapshot()
            unit.refresh(memory, told, now_ns)
            assert unit.changed_words or not any(memory.differences(before))
            if unit.wake_ns > now_ns:
                before = memory.snapshot()
                now_ns = min(unit.wake_ns - 1, now_ns + 10 * CYCLE_NS)
                assert unit.refresh(memory, [], now_ns) == []
                assert not any(memory.differences(before))
            now_ns += CYCLE_NS

    @pytest.mark.slow
    @inherited
    @given(st.data(), st.booleans())
    def test_what_it_does_not_watch_does_not_matter(self, data: st.DataObject, is_asked: bool) -> None:
        """As long as the unit has nothing to do by itself; a unit that says nothing of it is refreshed each time."""
        unit, memory = self.fresh()
        if is_asked:
            self.ask(memory)
        number = 1
        while number == 1 or ((unit.changed_words or unit.wake_ns == 0) and number < 20):
            unit.refresh(memory, [], number * CYCLE_NS)
            number += 1
        if unit.watched is None:
            return
        watched = {(area, word + more) for area, word in unit.watched for more in range(4)}
        own = st.sampled_from(sorted((self.may_write() | {("A", 501), ("A", 502), ("CIO", 1500)}) - watched))
        for area, word in data.draw(st.lists(own, max_size=10)):
            memory.words(area)[word] = data.draw(st.integers(0, 0xFFFF))
        before = memory.snapshot()
        assert unit.refresh(memory, [], number * CYCLE_NS) == []
        assert not any(memory.differences(before))

    @pytest.mark.slow
    @inherited
    @given(st.lists(st.lists(events(st.integers(0, 3)), max_size=4), max_size=12))
    def test_same_inputs_give_the_same_memory_and_requests(self, scans: list[list[Event]]) -> None:
        runs = []
        for _ in range(2):
            unit, memory = self.fresh()
            self.ask(memory)
            requests = [unit.refresh(memory, told, number * CYCLE_NS) for number, told in enumerate(scans)]
            runs.append((requests, memory.snapshot()))
        assert runs[0] == runs[1]
