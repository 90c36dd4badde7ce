"""The server against the model: any request, any cut of the stream, any trash, several clients, both timings."""

from __future__ import annotations

import pytest
from depth import times
from etn_modbus_rig import Client, Model, Rig
from hypothesis import given, settings
from hypothesis import strategies as st

from fbvm.net.faults import Fault
from fbvm.wire.modbus import FUNCTIONS, Adu, Splitter

pytestmark = pytest.mark.slow

TIMINGS = st.sampled_from(["exact", "exact", "real"])
SEEDS = st.integers(0, 10**6)
EDGES = [0, 1, 15, 16, 31, 319, 320, 5119, 5120, 5800, 5801, 6143, 6144, 32767, 32768, 65535]
NUMBERS = st.one_of(st.sampled_from(EDGES), st.integers(0, 65535))
QUANTITIES = st.one_of(
    st.integers(0, 40), st.sampled_from([122, 123, 124, 125, 126, 1967, 1968, 1969, 2000, 2001, 65535]), NUMBERS
)
UNIT_BITS, UNIT_WORDS, UNIT_DM = range(24000, 24400), range(1500, 1525), range(30000, 30100)


def touches(area: range, start: int, count: int) -> bool:
    return start < area.stop and start + count > area.start


def harmless(pdu: bytes) -> bool:
    """True if the words of the unit, which change by themselves, have no part in it."""
    code, start = pdu[0], int.from_bytes(pdu[1:3], "big")
    count = 1 if code in (5, 6) else int.from_bytes(pdu[3:5], "big")
    area = {1: UNIT_BITS, 2: UNIT_BITS, 5: UNIT_BITS, 15: UNIT_BITS, 4: UNIT_WORDS, 3: UNIT_DM, 6: UNIT_DM, 16: UNIT_DM}
    return code not in area or not touches(area[code], start, count)


@st.composite
def requests(draw: st.DrawFn) -> bytes:
    """PDUs: of each kind, mostly well formed, sometimes cut, longer, or any bytes."""
    code = draw(st.sampled_from([1, 2, 3, 4, 5, 6, 8, 15, 16]))
    address, quantity = draw(NUMBERS), draw(QUANTITIES)
    if code == 5:
        quantity = draw(st.sampled_from([0xFF00, 0, 0xFF00, 0, 1, 0xFFFF]))
    elif code == 8:
        address = draw(st.sampled_from([0, 0, 0, 1, 0x0A00]))
    pdu = bytes((code, *address.to_bytes(2, "big"), *quantity.to_bytes(2, "big")))
    if code in (15, 16):
        size = min(2 * quantity if code == 16 else (quantity + 7) // 8, 246)
        size = max(0, size + draw(st.sampled_from([0, 0, 0, 0, 1, -1])))
        pdu += bytes((size,)) + draw(st.binary(min_size=size, max_size=size))
    elif code == 8:
        pdu += draw(st.binary(max_size=248))
    match draw(st.integers(0, 9)):
        case 0:
            pdu = pdu[: draw(st.integers(1, len(pdu)))]
        case 1:
            pdu += draw(st.binary(max_size=10))
        case 2:
            pdu = draw(st.binary(min_size=1, max_size=30))
    return pdu[:253]


HARMLESS = requests().filter(harmless)


@pytest.mark.slow
@given(TIMINGS, SEEDS, st.booleans(), st.booleans(), st.lists(HARMLESS, min_size=1, max_size=20))
@settings(max_examples=times(50), deadline=None)
def test_it_answers_as_the_model_does(timing: str, seed: int, fn0f: bool, full_dm: bool, asked: list[bytes]) -> None:
    rig = Rig(f"Fn0F := {fn0f}, Full_DM := {full_dm}", timing=timing, seed=seed)
    rig.fill(seed)
    client, model = rig.client(), Model(rig, fn0f=fn0f, full_dm=full_dm)
    for pdu in asked:
        assert client.exchange(pdu, seed & 0xFF) == model.answer(pdu)
    assert model.agrees(rig)
    rig.scan(20)
    exceptions, received, sent, *errors = rig.counters()
    assert (received, sent, errors) == (len(asked), len(asked), [0, 0])
    assert exceptions == model.exceptions


@pytest.mark.slow
@given(TIMINGS, SEEDS, st.lists(HARMLESS, min_size=1, max_size=30), st.integers(1, 300), st.booleans(),
       st.integers(0, 30_000_000))  # fmt: skip
@settings(max_examples=times(40), deadline=None)
def test_any_cut_of_a_pipeline(
    timing: str, seed: int, asked: list[bytes], segment_bytes: int, random_cut: bool, gap_ns: int
) -> None:
    """All at once, in pieces of any size; the answers come in order."""
    rig = Rig("Fn0F := TRUE", timing=timing, seed=seed)
    rig.fill(seed)
    model = Model(rig, fn0f=True)
    rig.network.faults.append(Fault(segment_bytes=segment_bytes, random_cut=random_cut, gap_ns=gap_ns))
    client = rig.client()
    client.say(b"".join(Adu(number, 1, pdu).to_bytes() for number, pdu in enumerate(asked)))
    replies = client.frames(len(asked), scans=40_000)
    assert replies == [Adu(number, 1, model.answer(pdu)) for number, pdu in enumerate(asked)]
    assert model.agrees(rig)


def still_serves(rig: Rig) -> None:
    client = rig.client()
    assert client.ask("08 00 00 12 34") == "08 00 00 12 34"
    client.leave()


@pytest.mark.slow
@given(TIMINGS, SEEDS, st.lists(st.binary(min_size=1, max_size=600), min_size=1, max_size=5), st.sampled_from("flr"))
@settings(max_examples=times(50), deadline=None)
def test_trash_neither_stops_it_nor_writes_anything(timing: str, seed: int, trash: list[bytes], end: str) -> None:
    rig = Rig("Idle_Time := T#3s", timing=timing, seed=seed)
    rig.fill(seed)
    client, model = rig.client(), Model(rig)
    splitter = Splitter()
    for data in trash:
        client.say(data)
        client.hear(20)
        for found in splitter.feed(data):
            if isinstance(found, Adu) and harmless(found.pdu):
                model.answer(found.pdu)
    if end != "f":
        client.leave(reset=end == "r")
    still_serves(rig)
    assert model.agrees(rig)


@st.composite
def damaged_streams(draw: st.DrawFn) -> list[tuple[bytes, bytes]]:
    """Frames, and among them some of another protocol; each with the PDU that is to be answered, or nothing."""
    stream = []
    for number in range(draw(st.integers(1, 12))):
        pdu = draw(HARMLESS)
        frame = Adu(number, 1, pdu).to_bytes()
        if draw(st.integers(0, 3)) == 0:
            protocol = draw(st.integers(1, 65535))
            stream.append((frame[:2] + protocol.to_bytes(2, "big") + frame[4:], b""))
        else:
            stream.append((frame, pdu))
    return stream


@pytest.mark.slow
@given(TIMINGS, SEEDS, damaged_streams(), st.sampled_from([0, 1, 255, 256, 0xFFFF]))
@settings(max_examples=times(40), deadline=None)
def test_what_has_a_wrong_protocol_or_length_is_never_executed(
    timing: str, seed: int, stream: list[tuple[bytes, bytes]], length: int
) -> None:
    rig = Rig(timing=timing, seed=seed)
    rig.fill(seed)
    client, model = rig.client(), Model(rig)
    for frame, _ in stream:
        client.say(frame)
    replies = [model.answer(pdu) for _, pdu in stream if pdu]
    assert [reply.pdu for reply in client.frames(len(replies))] == replies
    # Behind a length that cannot be stands a right request, which nobody can find.
    client.say(b"\0\0\0\0" + length.to_bytes(2, "big") + b"\xff" + Adu(9, 1, b"\6\0\0\x55\x55").to_bytes())
    assert client.hear(60) == b""
    assert client.end in ("FIN", "ECONNRESET")
    assert model.agrees(rig)
    still_serves(rig)


CONVERSATION = st.lists(st.tuples(st.integers(0, 7), HARMLESS, st.integers(0, 6)), min_size=1, max_size=30)


@pytest.mark.slow
@given(TIMINGS, SEEDS, st.integers(2, 8), CONVERSATION, st.integers(1, 300), st.integers(0, 20_000_000))
@settings(max_examples=times(40), deadline=None)
def test_several_clients_at_once(
    timing: str, seed: int, sockets: int, said: list[tuple[int, bytes, int]], segment_bytes: int, gap_ns: int
) -> None:
    """Each gets its own answers, in order, however they are mixed; writes are tried on nothing that others read."""
    rig = Rig(f"Sockets := {sockets}", timing=timing, seed=seed)
    rig.fill(seed)
    model = Model(rig)
    clients = [rig.client() for _ in range(sockets)]
    rig.network.faults.append(Fault(segment_bytes=segment_bytes, random_cut=True, gap_ns=gap_ns))
    expected: list[list[Adu]] = [[] for _ in clients]
    for number, (who, pdu, pause) in enumerate(said):
        if pdu[0] in FUNCTIONS and pdu[0] not in (5, 6, 15, 16):
            client: Client = clients[who % sockets]
            client.say(Adu(number, who, pdu).to_bytes())
            expected[who % sockets].append(Adu(number, who, model.answer(pdu)))
            rig.scan(pause)
    for client, replies in zip(clients, expected, strict=True):
        assert client.frames(len(replies), scans=40_000) == replies
    assert model.agrees(rig)
    assert rig.counters()[3:] == [0, 0]
