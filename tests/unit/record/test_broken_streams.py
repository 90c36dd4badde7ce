"""Bytes that are no frames, in streams of Modbus and of FINS; what a chart shows of a PLC with a unit."""

from __future__ import annotations

import pytest

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.record.trace.packets import Dissector, Packet, add_tap
from fbvm.record.trace.recorder import default_signals, description_of, signals_of
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.fins import tcp
from fbvm.wire.fins.frames import PORT
from fbvm.wire.link import Peer
from fbvm.wire.tap import Tap, TapEvent, TapKind

UNIT, SERVER, FINS = Peer("192.168.250.21", 49152), Peer("192.168.250.1", 502), Peer("192.168.250.1", PORT)


def told(server: Peer, *contents: bytes) -> list[tuple[str, bytes]]:
    reader = Dissector()
    events = [TapEvent(TapKind.DATA, UNIT, server, True, content) for content in contents]
    return [(packet.info, packet.data) for event in events for packet in reader.dissect(0, event)]


def test_behind_bytes_that_are_no_modbus_there_are_only_bytes() -> None:
    first, *behind = told(SERVER, b"\0\1\0\0\0\0\1\3", b"a", b"bc")
    assert first[0].startswith("8 bytes, no Modbus: ") and first[1] == b"\0\1\0\0\0\0\1\3"
    assert behind == [("1 byte", b"a"), ("2 bytes", b"bc")]


def test_behind_bytes_that_are_no_fins_there_are_only_bytes() -> None:
    first, *behind = told(FINS, b"FONS" + bytes(12), b"a", b"bc")
    assert first[0].startswith("16 bytes, no FINS/TCP: ") and first[1] == b"FONS" + bytes(12)
    assert behind == [("1 byte", b"a"), ("2 bytes", b"bc")]


def test_a_message_of_fins_in_part_and_whole() -> None:
    whole = tcp.Message(0, bytes(4)).to_bytes()
    part, made = told(Peer("192.168.250.1", 40_000), whole[:7], whole[7:])
    assert part == ("7 bytes, a FINS/TCP message in part", whole[:7])
    assert made[1] == whole


def test_events_beside_data_are_told_with_their_size() -> None:
    reader = Dissector()
    event = TapEvent(TapKind.UDP, UNIT, SERVER, False, b"x")
    assert list(reader.dissect(5, event)) == [Packet(5, SERVER, UNIT, "datagram of 1 byte", b"x")]
    assert str(Packet(5, SERVER, UNIT, "datagram of 1 byte")) == f"{SERVER} -> {UNIT}  datagram of 1 byte"
    assert [packet.info for packet in reader.dissect(5, TapEvent(TapKind.FIN, UNIT, SERVER, True))] == [
        "ends its side of the connection"]  # fmt: skip


def test_what_two_units_exchange_is_told_once_where_both_are_listened_to() -> None:
    for once, out, mirrored, count in (
            (True, True, True, 1), (True, False, True, 0), (True, False, False, 1), (False, False, True, 1)):  # fmt: skip
        event = TapEvent(TapKind.UDP, UNIT, SERVER, out, b"x", mirrored)
        assert len(list(Dissector(once=once).dissect(0, event))) == count


def test_a_tap_more_leaves_the_one_before() -> None:
    class Network:
        tap: Tap | None = None

    network, seen = Network(), list[tuple[str, int, str]]()
    event = TapEvent(TapKind.FIN, UNIT, SERVER, True)
    first: Tap = lambda now_ns, unit, _: seen.append(("first", now_ns, unit))  # noqa: E731
    second: Tap = lambda now_ns, unit, _: seen.append(("second", now_ns, unit))  # noqa: E731
    assert add_tap(network, first) is None
    before = network.tap
    assert add_tap(network, second) is before
    assert network.tap is not None
    network.tap(7, "u", event)
    assert seen == [("first", 7, "u"), ("second", 7, "u")]


@pytest.mark.slow
def test_a_chart_shows_what_a_unit_describes_before_values_of_the_program() -> None:
    compilation = compile_text("PROGRAM Main VAR n : INT; a : ARRAY [0..1] OF INT; END_VAR n := a[0]; END_PROGRAM")
    assert compilation.image is not None
    plc = Plc(compilation.image)
    assert [each.place.name for each in default_signals(plc)] == ["Main.n"]
    etn21 = Etn21()
    plc.attach(etn21, LoopNetwork())
    described = [signal.place.name for address in etn21.descriptions for signal in signals_of(plc, address)]
    assert [each.place.name for each in default_signals(plc)] == [*described, "Main.n"] != ["Main.n"]
    address, text = next(iter(etn21.descriptions.items()))
    (signal,) = signals_of(plc, address)[:1]
    assert description_of(plc, signal.place) == text
