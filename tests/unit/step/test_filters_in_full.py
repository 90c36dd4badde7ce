"""What the filters between two scans make of each event of a network, of each response code and of each other."""

from __future__ import annotations

from collections.abc import Iterable
from types import SimpleNamespace
from typing import Any

from rows import each_of

from fbvm.base.types import WORD
from fbvm.step.filters import BETWEEN, FILTERS, BetweenScans
from fbvm.watch.paths import Place
from fbvm.wire.link import Peer
from fbvm.wire.tap import TapEvent, TapKind

MS = 1_000_000
UNIT, SERVER, OTHER = Peer("10.0.0.1", 1025), Peer("10.0.0.2", 502), Peer("10.0.0.3", 502)


def adu(pdu: bytes, transaction: int = 7) -> bytes:
    return transaction.to_bytes(2, "big") + b"\0\0" + (len(pdu) + 1).to_bytes(2, "big") + b"\x05" + pdu


BAD = adu(b"\x83\x02")
SAID = "Modbus 7, unit 5: 03 read holding registers, exception 02 illegal data address"


def plc(*units: Any, networks: Iterable[Any] = ()) -> Any:
    given = [*networks] or [SimpleNamespace() for _ in units]
    attached = [SimpleNamespace(unit=unit, network=network) for unit, network in zip(units, given, strict=True)]
    return SimpleNamespace(units=attached, now_ns=0, cycle_ns=10 * MS, scans=5)


def event(data: bytes = BAD, *, kind: TapKind = TapKind.DATA, remote: Peer = SERVER, out: bool = False,
          mirrored: bool = False) -> TapEvent:  # fmt: skip
    return TapEvent(kind, UNIT, remote, out, data, mirrored)


@each_of("events, codes, said", [
    ([event()], [], SAID), ([event(out=True)], [], SAID), ([event(mirrored=True, out=True)], [], SAID),
    ([event(mirrored=True)], [], ""), ([event(kind=TapKind.UDP)], [], ""), ([event(kind=TapKind.FIN)], [], ""),
    ([event()], [2], SAID), ([event()], [1, 3], ""), ([event()], [1, 2, 3], SAID), ([], [], ""),
    ([event(adu(b"\x03\x02\0\1"))], [], ""), ([event(adu(b""))], [], ""), ([event(adu(b"\x7f\x02"))], [], ""),
    ([event(adu(b"\x86\x0b", 300))], [], "Modbus 300, unit 5: 06 write single register, exception 0B "
                                         "gateway target device failed to respond"),
    # the first of several, whatever lies before it, however it is cut
    ([event(adu(b"\x03\x02\0\1") + BAD + adu(b"\x83\x03", 8))], [], SAID),
    ([event(BAD[:4]), event(BAD[4:8]), event(BAD[8:])], [], SAID),
    ([event(BAD[:4]), event(BAD[4:8])], [], ""), ([event(adu(b"\x83\x03", 8)), event()], [2], SAID),
    # each direction of each connection is a stream of its own
    ([event(BAD[:4]), event(BAD[:6], remote=OTHER), event(BAD[4:])], [], SAID),
    ([event(BAD[:4]), event(BAD[:6], out=True), event(BAD[4:])], [], SAID), ([event(BAD[:4]), event(BAD[4:], out=True)], [], ""),
    # behind a length that cannot be nothing is read any more, until the connection is opened anew
    ([event(b"\0\1\0\0\xff\xff"), event()], [], ""),
    ([event(b"\0\1\0\0\xff\xff"), event(b"", kind=TapKind.OPEN), event()], [], SAID),
    ([event(BAD[:4]), event(b"", kind=TapKind.OPEN, out=True), event()], [], SAID),
    ([event(BAD[:4], out=True), event(b"", kind=TapKind.OPEN), event(out=True)], [], SAID),
    ([event(BAD[:4]), event(b"", kind=TapKind.OPEN, remote=OTHER), event(BAD[4:])], [], SAID),
])
def test_exception_replies_that_pass_a_network(events: list[TapEvent], codes: list[int], said: str) -> None:
    network = SimpleNamespace()
    made, filters = plc(object(), object(), networks=[network, network]), BetweenScans({"modbus": frozenset(codes)})
    filters.attached(made)
    for each in events:
        network.tap(0, "10.0.0.1", each)
    assert filters.checked(made) is bool(said) and (filters.found, filters.kind) == (said, "modbus" if said else "")
    assert not filters.checked(made), "it is told once"


def test_a_network_is_listened_to_once_and_only_if_somebody_asks() -> None:
    one, two = SimpleNamespace(), SimpleNamespace(tap=lambda *given: told.append(given))
    told: list[Any] = []
    BetweenScans({"response": frozenset()}).attached(plc(object(), networks=[one]))
    assert vars(one) == {}
    filters = BetweenScans({"modbus": frozenset()})
    made = plc(object(), object(), object(), networks=[one, two, one])
    filters.attached(made)
    for network in (one, two):
        network.tap(3, "10.0.0.1", event())
    assert told == [(3, "10.0.0.1", event())], "who listened before still does"
    assert filters._passed == [SAID, SAID]
    one.tap(3, "10.0.0.1", event())
    filters.attached(plc(object(), networks=[SimpleNamespace()]))
    assert not filters.checked(plc()), "of another PLC nothing has passed"


class Coded:
    """A unit with these response codes by address."""

    def __init__(self, meanings: dict[str, dict[int, str]], **names: str) -> None:
        self.descriptions, self.meanings = names, meanings


class CodedPlc:
    """A PLC whose words are what they are set to."""

    def __init__(self, *units: Any) -> None:
        self.units = [SimpleNamespace(unit=unit, network=SimpleNamespace()) for unit in units]
        self.words: dict[str, Any] = {f"D{number}": 0 for number in range(9)}
        self.now_ns, self.cycle_ns, self.scans = 0, 10 * MS, 1

    def find(self, address: str) -> Any:
        return Place(address, WORD, int(address[1:])) if address != "D8" else SimpleNamespace(name="D8")

    def read(self, place: Any) -> Any:
        return self.words[place.name]


@each_of("codes, steps", [
    # each step sets words; what is said of it
    ([], [({"D1": 0x302}, "D1 Response Code is 16#0302: no service"), ({}, ""), ({"D1": 0x303}, "D1 Response Code is 16#0303"),
          ({"D1": 0}, ""), ({"D1": 0x303}, "D1 Response Code is 16#0303")]),
    ([], [({"D2": 1}, "D2 Response Code is 16#0001: other"), ({"D1": 5}, "D1 Response Code is 16#0005"),
          ({"D1": 6, "D2": 2}, "D1 Response Code is 16#0006"), ({"D5": 7}, ""), ({"D8": 7}, "")]),
    ([0x302, 9], [({"D1": 1}, ""), ({"D1": 9}, "D1 Response Code is 16#0009"),
                  ({"D1": 1, "D2": 0x302}, "D2 Response Code is 16#0302")]),
])
def test_a_response_code_is_told_when_it_becomes_another_one(codes: list[int], steps: list[tuple[dict[str, int], str]]) -> None:
    made: Any = CodedPlc(Coded({"D1": {0x302: "no service"}}, D1="Response Code", D5="Status", D8="Response Code"), object(),
                         Coded({"D1": {0x302: "never read"}, "D2": {1: "other"}}, D2="Response Code of the second"))
    filters = BetweenScans({"response": frozenset(codes)})
    filters.attached(made)
    for words, said in steps:
        made.words |= words
        filters.found = filters.kind = ""
        assert filters.checked(made) is bool(said), words
        assert (filters.found, filters.kind) == (said, "response" if said else "")


def test_of_several_things_in_a_scan_the_first_filter_tells() -> None:
    made: Any = CodedPlc(Coded({}, D1="Response Code"))
    filters = BetweenScans({name: frozenset() for name in BETWEEN}, lambda scan: scan == 6)
    filters.attached(made)
    found = []
    for now_ms, scans, code, packets in ((25, 7, 1, [event()]), (35, 7, 2, [event()]), (45, 8, 3, [event()]), (55, 8, 4, [])):
        made.now_ns, made.scans, made.words["D1"] = now_ms * MS, scans, code
        for each in packets:
            made.units[0].network.tap(0, "", each)
        assert filters.checked(made)
        found.append((filters.kind, filters.found))
    assert found == [("late", "scan 6 began 15ms late"), ("differs", "scan 6 comes out differently here: its memory is not the "
                                                                    "recorded one"),
                     ("modbus", SAID), ("response", "D1 Response Code is 16#0004")]  # fmt: skip


@each_of("delay_ms, wanted, scans, late", [
    (9.9, [], 5, False), (10, [], 5, True), (4.9, [5], 5, False), (5, [5], 5, True), (5, [7, 5, 9], 5, True), (5, [], 5, False),
    (10, [], 1, False), (10, [], 2, True), (0, [0], 5, False), (0.1, [0], 5, True), (1e-6, [0], 5, True), (-3, [0], 5, False)])
def test_a_scan_is_late_from_the_delay_on_that_is_asked_for(delay_ms: float, wanted: list[int], scans: int, late: bool) -> None:
    made, filters = plc(), BetweenScans({"late": frozenset(wanted)})
    filters.attached(made)
    made.now_ns, made.scans = round((10 + delay_ms) * MS), scans
    assert filters.checked(made) is late and filters.kind == ("late" if late else "")
    other = BetweenScans({})
    other.attached(plc())
    assert not other.checked(made)


def test_filters_that_are_on_at_first() -> None:
    """Those of what is wrong with the program or with fbvm; not those of what a network may do."""
    assert [each.name for each in FILTERS if each.default] == ["trap", "watchdog", "response", "differs"]
    assert [each.name for each in FILTERS if each.condition] == ["modbus", "response", "late"]
