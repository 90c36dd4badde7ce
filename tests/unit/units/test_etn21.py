"""The ETN21 as a unit: what every unit owes, its ranges, restart, mode change, several units, wrong arguments."""

from __future__ import annotations

from copy import deepcopy

import pytest
from common_unit_tests import CommonUnitTests, FakeMemory
from etn21_rig import E2, SERVER, Rig
from rows import each_of

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.units.contract import Unit
from fbvm.units.etn21.map import LINK_UP, Layout, Switch
from fbvm.units.etn21.unit import Etn21, Fault
from fbvm.wire.link import Bind, Close, Closed, Connect, Grant, Opened, Received, Sent


def writable(unit_number: int) -> set[tuple[str, int]]:
    """n, n+1..n+23, m+1..m+17, the words +1..+5, +9 of the eight areas, and the two words for all CPU bus units."""
    n, m = 1500 + 25 * unit_number, 30000 + 100 * unit_number
    own = {("A", 302), ("A", 501)} | {("CIO", word) for word in range(n, n + 24)} | {("D", word) for word in range(m + 1, m + 18)}
    return own | {("D", m + 18 + 10 * area + offset) for area in range(8) for offset in (1, 2, 3, 4, 5, 9)}


class TestEtn21IsAUnit(CommonUnitTests):
    unit_number = 0

    def new_unit(self) -> Unit:
        return Etn21(self.unit_number)

    def may_write(self) -> set[tuple[str, int]]:
        return writable(self.unit_number)

    def data_words(self) -> set[tuple[str, int]]:
        return set()

    def ask(self, memory: FakeMemory) -> None:
        layout = Layout.of(self.unit_number)
        first = layout.parameters(1)
        for offset, value in enumerate((1, 0, 0xC0A8, 0xFA07, 502, 0, 0x8203, 0xE800, 0, 0xFFFF)):
            memory.words("D")[first + offset] = value
        memory.words("CIO")[layout.n + 19] |= 1 << Switch.ACTIVE_OPEN

    def is_answered(self, memory: FakeMemory) -> bool:
        layout = Layout.of(self.unit_number)
        switch_off = not memory.words("CIO")[layout.n + 19]
        return switch_off and memory.words("D")[layout.parameters(1) + 9] == 0


class TestEtn21WithTheLastNumberIsAUnit(TestEtn21IsAUnit):
    unit_number = 15


@pytest.mark.parametrize(("number", "n", "m"), [(0, 1500, 30000), (1, 1525, 30100), (15, 1875, 31500)])
def test_the_unit_number_sets_the_words(number: int, n: int, m: int) -> None:
    rig = Rig(Etn21(number))
    rig.open()
    assert rig.memory.words("CIO")[n + 9] == 0x8000
    assert rig.memory.words("D")[m + 9] == 4
    assert rig.memory.words("D")[m + 18 + 9] == 0


@pytest.mark.parametrize("number", [-1, 16])
def test_other_unit_numbers_are_a_mistake(number: int) -> None:
    with pytest.raises(ValueError, match="unit number"):
        Etn21(number)


@pytest.mark.parametrize("address", ["", "x", "1.2.3", "1.2.3.256", "1.2.3.-4", "1.2.3.4.5", "::1"])
def test_an_address_that_is_none_is_a_mistake(address: str) -> None:
    with pytest.raises(ValueError, match=r'is no IPv4 address; write "192\.168\.250\.1"'):
        Etn21(address=address)


@pytest.mark.parametrize("filler", [-1, 256])
def test_an_odd_filler_that_is_no_byte_is_a_mistake(filler: int) -> None:
    with pytest.raises(ValueError, match="is no byte"):
        Etn21(odd_filler=filler)


def test_an_unknown_timing_is_a_mistake() -> None:
    with pytest.raises(ValueError, match="timing"):
        Etn21(timing="swift")


@each_of("area", range(1, 9))
def test_each_area_has_its_switches_and_words(area: int) -> None:
    rig = Rig()
    rig.parameters(area, socket=9 - area)
    word, bit = 1519 + (area - 1) // 2, 2 + (0 if area % 2 else 8)
    rig.cio[word] = 1 << bit
    assert rig.scan() == [Connect(9 - area, SERVER)]
    rig.scan(Opened(9 - area, 50000, SERVER))
    assert rig.cio[word] == 0
    assert rig.d[30018 + 10 * (area - 1) + 9] == 0
    assert rig.status(9 - area) == 0x8000


def test_eight_sockets_are_open_at_once() -> None:
    rig = Rig()
    for number in range(1, 9):
        rig.open(number, number)
    assert [rig.status(number) for number in range(1, 9)] == [0x8000] * 8


def test_eight_areas_ask_in_one_cycle() -> None:
    rig = Rig()
    for number in range(1, 9):
        rig.parameters(number, number)
        rig.turn_on(Switch.ACTIVE_OPEN, number)
    assert rig.scan() == [Connect(number, SERVER) for number in range(1, 9)]
    rig.scan(*[Opened(number, 50000 + number, SERVER) for number in range(1, 9)])
    assert [rig.status(number) for number in range(1, 9)] == [0x8000] * 8


@pytest.mark.parametrize("area", [1, 2, 8])
@pytest.mark.parametrize("switch", [Switch.UDP_OPEN, Switch.ACTIVE_OPEN])
def test_each_switch_alone_is_seen_by_a_unit_that_nobody_has_used(area: int, switch: Switch) -> None:
    rig = Rig()
    assert rig.unit.exchanged is None, "it has nothing to do"
    rig.parameters(area, area, local_port=5000)
    [request, *_] = rig.scan(switch, area=area)
    assert type(request) is (Bind if switch is Switch.UDP_OPEN else Connect)


def test_two_units_share_one_memory() -> None:
    first, second = Rig(), Rig(Etn21(1, "192.168.250.2"))
    second.memory, second.cio, second.d = first.memory, first.cio, first.d
    first.open(1)
    second.open(2)
    assert (first.status(1), first.status(2), second.status(1), second.status(2)) == (0x8000, 0, 0, 0x8000)


def test_link_bit_and_error_status_are_shown_assumed() -> None:
    rig = Rig()
    assert rig.cio[1517] == LINK_UP == 1 << 14
    rig.unit.link_up = False
    rig.unit.error_status = 1 << 14
    rig.scan()
    assert (rig.cio[1517], rig.cio[1518]) == (0, 1 << 14)


def test_a_unit_with_nothing_to_do_runs_again_when_a_status_word_was_overwritten() -> None:
    rig = Rig()
    rig.open()
    rig.scan()
    for word in (1517, 1518):
        assert not rig.unit.exchange(rig.memory, [], rig.now_ns) and not rig.unit.changed_words
        shown = rig.cio[word]
        rig.cio[word] = 7
        assert rig.unit.exchange(rig.memory, [], rig.now_ns) and rig.unit.changed_words
        assert rig.cio[word] == shown


def test_what_a_unit_waits_for_comes_at_the_time_that_it_says_and_not_before() -> None:
    rig = Rig()
    rig.open()
    rig.parameters(count=2, timeout=10)
    rig.scan(Switch.RECEIVE)
    rig.scan()
    wake_ns = rig.unit.wake_ns
    assert not rig.unit.exchange(rig.memory, [], wake_ns - 1) and rig.unit.exchange(rig.memory, [], wake_ns)
    assert rig.code() == "0080"


def test_a_mode_change_clears_the_status_but_not_the_socket() -> None:
    rig = Rig()
    rig.open()
    rig.cio[1500:1525] = memoryview(bytes(50)).cast("H")
    rig.scan()
    assert rig.status() == 0
    rig.parameters()
    assert rig.ask(Switch.ACTIVE_OPEN) == "220F"
    rig.parameters()
    assert rig.ask(Switch.CLOSE, Closed(1)) == "0000"
    rig.open()


def test_a_service_that_lost_its_switch_runs_on_assumed() -> None:
    rig = Rig()
    rig.parameters()
    rig.scan(Switch.ACTIVE_OPEN)
    rig.turn_off(Switch.ACTIVE_OPEN)
    rig.scan()
    rig.scan(Opened(1, 50000, SERVER))
    assert rig.is_open()
    assert rig.code() == "0000"


def test_a_switch_held_on_starts_again_each_time_assumed() -> None:
    rig = Rig()
    rig.parameters()
    codes = []
    for _ in range(6):
        rig.scan(Switch.SEND)
        codes.append((rig.is_on(Switch.SEND), rig.code()))
    assert codes == [(True, "FFFF"), (False, "2210"), (True, "2210"), (False, "2210"), (True, "2210"), (False, "2210")]


def test_a_restart_clears_the_words_and_breaks_the_connections() -> None:
    rig = Rig()
    rig.open(1, 1)
    rig.open(2, 2)
    assert rig.unit.reset(rig.memory) == [Close(1, reset=True), Close(2, reset=True)]
    assert rig.cio[1501:1517].tolist() == [0] * 16
    assert rig.d[30001:30018].tolist() == [0] * 17


def test_an_open_waits_until_the_network_has_closed_the_socket_of_before_a_restart() -> None:
    rig = Rig()
    rig.open()
    rig.unit.reset(rig.memory)
    rig.parameters()
    assert rig.scan(Switch.ACTIVE_OPEN) == []
    assert rig.scan() == []
    assert rig.scan(Closed(1)) == [Connect(1, SERVER)]
    rig.scan(Opened(1, 49153, SERVER))
    assert rig.code() == "0000"


@pytest.mark.parametrize("number", [0, 1, 15])
def test_a_program_restarts_the_unit(number: int) -> None:
    """A501 bit N: connections break, A302 bit N is ON while the unit starts, then both bits are OFF; others stay."""
    rig = Rig(Etn21(number))
    rig.open()
    a = rig.memory.words("A")
    mine, others = 1 << number, 0x5554 & ~(1 << number)
    a[501] = mine | others
    a[302] = others
    assert rig.scan() == [Close(1, reset=True)]
    assert (a[302], a[501], rig.status(), rig.state()) == (others | mine, others | mine, 0, 0)
    rig.parameters()
    assert rig.scan(Switch.ACTIVE_OPEN, Closed(1)) == []
    assert (a[302], a[501]) == (others, others)
    assert rig.scan() == [Connect(1, SERVER)], "what was requested meanwhile is seen now"
    rig.scan(Opened(1, 49153, SERVER))
    assert (rig.code(), rig.is_open()) == ("0000", True)


def test_a_restart_takes_1_to_3_s_assumed() -> None:
    rig = Rig(Etn21(timing="real", seed=5))
    a = rig.memory.words("A")
    a[501] = 1
    rig.scan()
    began_ns = rig.now_ns
    while a[302]:
        assert rig.scan() == []
    assert 1_000_000_000 <= rig.now_ns - began_ns <= 3_010_000_000
    assert a[501] == 0


def test_a_restart_takes_3_to_7_refreshes_where_these_take_longer_assumed() -> None:
    taken = set()
    for seed in range(60):
        rig = Rig(Etn21(timing="real", seed=seed), cycle_ms=10_000)
        initializing, restart = rig.memory.words("A")[302:303], rig.memory.words("A")[501:502]
        restart[0] = 1
        rig.scan()
        refreshes = 0
        while initializing[0]:
            rig.scan()
            refreshes += 1
        taken.add(refreshes)
    assert taken == {3, 4, 5, 6, 7}


def test_until_a_restart_is_over_its_status_words_stay_whatever_the_program_does() -> None:
    rig = Rig(Etn21(timing="real"))
    rig.memory.words("A")[501] |= 1
    for _ in range(10):
        rig.scan()
    rig.memory.words("A")[501] = 0
    rig.unit.link_up = False
    for _ in range(10):
        rig.scan()
        assert (rig.cio[1517], rig.memory.words("A")[302]) == (LINK_UP, 1)
    rig.wait(3)
    rig.scan()
    assert (rig.cio[1517], rig.memory.words("A")[302]) == (0, 0)


def test_the_restart_bit_of_another_unit_is_none_of_its_business() -> None:
    rig = Rig()
    rig.open()
    rig.memory.words("A")[501] = 0xFFFE
    assert rig.scan() == []
    assert rig.is_open()
    assert rig.memory.words("A")[501] == 0xFFFE


def test_what_comes_at_once_after_a_restart_is_kept_even_if_the_network_answers_before_it_is_asked() -> None:
    rig = Rig()
    rig.open()
    rig.unit.reset(rig.memory)
    rig.parameters(count=4)
    assert rig.scan(Switch.ACTIVE_OPEN) == []
    asked = rig.scan(Closed(1), Opened(1, 49152, SERVER), Received(1, b"abcd"))
    assert asked == [Connect(1, SERVER), Grant(1, 4096)]
    rig.parameters(count=4)
    assert rig.ask(Switch.RECEIVE) == "0000"
    assert rig.d[1000:1002].tolist() == [0x6162, 0x6364]


@pytest.mark.parametrize("events", [1, 64, 65, 300])
def test_a_copy_has_what_the_unit_has_received_and_not_taken_yet(events: int) -> None:
    rig = Rig()
    rig.open()
    rig.scan(*[Received(1, bytes((number % 256,))) for number in range(events)])
    rig.unit = deepcopy(rig.unit)
    for _ in range(6):
        rig.scan()
    rig.parameters(count=1984)
    assert rig.ask(Switch.RECEIVE) == "0000"
    words = rig.d[1000 : 1000 + (events + 1) // 2].tolist()
    assert b"".join(word.to_bytes(2, "big") for word in words)[:events] == bytes(number % 256 for number in range(events))


def test_a_unit_that_comes_to_another_plc_knows_its_banks() -> None:
    rig = Rig()
    rig.open()
    rig.parameters(count=2, address=(E2, 0, 0))
    assert rig.ask(Switch.SEND, Sent(1, 2)) == "0000"
    smaller = FakeMemory()
    del smaller._areas["E2"]
    for area in ("CIO", "D"):
        smaller.words(area)[:] = rig.memory.words(area)
    rig.memory, rig.cio, rig.d = smaller, smaller.words("CIO"), smaller.words("D")
    rig.parameters(count=2, address=(E2, 0, 0))
    assert rig.ask(Switch.SEND, Sent(1, 2)) == "1101"


def test_faults_that_are_refused_leave_the_others_as_they_were() -> None:
    unit = Etn21(faults=[Fault(0x2211), Fault(0x0302, Switch.SEND, 1)])
    before = [*unit.faults]
    with pytest.raises(ValueError, match=r"response code 65536 is not in 0\.\.65535"):
        unit.faults[:] = [Fault(1), Fault(0x10000)]
    with pytest.raises(ValueError, match="room for 255 faults; 256 were given"):
        unit.faults[1:1] = [Fault(1)] * 254
    assert unit.faults == before


def test_a_unit_that_nobody_has_asked_anything_asks_for_nothing() -> None:
    unit = Etn21(0, "192.168.250.1")
    assert unit.finish() == [], "it is in no PLC"
    image = compile_text("PROGRAM Main END_PROGRAM").image
    assert image is not None
    plc = Plc(image)
    plc.attach(unit, LoopNetwork())
    plc.scan()
    assert unit.finish() == [], "its program is not on"
