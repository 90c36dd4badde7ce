"""Every kind of hostile client against every server on both engines: what is not valid changes no word and gets its exception
or its close, and the next client is served."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from server_rig import KINDS, READ, SMALL, Caller, ServerRig

from fbvm.wire.modbus import Adu

VALUE, ADDRESS, FUNCTION = 3, 2, 1
"""Exceptions of the Modbus specification."""
WRITE = "06 0005 BEEF"
"""A valid write, which must not be executed where it stands behind something that is not valid."""

INVALID = {
    # Function codes.
    "function 00": ("00", FUNCTION),
    "function 80": ("80 0000 0001", FUNCTION),
    "function FF": ("FF 0000 0001", FUNCTION),
    "a function of serial lines": ("07", FUNCTION),
    "device identification": ("2B 0E 01 00", FUNCTION),
    "a reply": ("83 02", FUNCTION),
    "a mask write": ("16 0005 00F2 0025", FUNCTION),
    # Sizes.
    "a function code only": ("03", VALUE),
    "a read that is short": ("03 0000", VALUE),
    "a read that is long": ("03 0000 0001 00", VALUE),
    "the reply of a read": ("03 02 BEEF", VALUE),
    "a write that is short": ("06 0005 BE", VALUE),
    "a write that is long": ("06 0005 BEEF 00", VALUE),
    "a write of several without data": ("10 0005 0001", VALUE),
    "a write of several with less data than counted": ("10 0005 0002 04 BEEF BE", VALUE),
    "a write of several with more data than counted": ("10 0005 0001 02 BEEF BEEF", VALUE),
    "a byte count one less": ("10 0005 0002 03 BEEF BEEF", VALUE),
    "a byte count of another quantity": ("10 0005 0001 04 BEEF BEEF", VALUE),
    "a byte count of 0": ("10 0005 0001 00", VALUE),
    # Quantities, values.
    "a quantity of 0": ("03 0000 0000", VALUE),
    "a quantity of 126": ("03 0000 007E", VALUE),
    "a quantity of 65535": ("03 0000 FFFF", VALUE),
    "a write of 0": ("10 0005 0000 00", VALUE),
    "a write of 124": ("10 0005 007C F8" + " BEEF" * 123, VALUE),
    "a write of 32769, whose byte count is that of one": ("10 0005 8001 02 BEEF", VALUE),
    "2001 coils": ("01 0000 07D1", VALUE),
    "a coil that is neither ON nor OFF": ("05 0005 00FF", VALUE),
    "1969 coils": ("0F 0005 07B1 F7" + " FF" * 246, VALUE),
    # Addresses.
    "an address that nobody has": ("03 FFFF 0001", ADDRESS),
    "a range over the end": ("03 FFFF 007D", ADDRESS),
    "a write that nobody has": ("06 FFFF BEEF", ADDRESS),
    "a write of several over the end": ("10 FFFF 0002 04 BEEF BEEF", ADDRESS),
    # Both ways at once, of those that know it.
    "a write and read, short": ("17 0000 0001 0005 0001 02 BE", VALUE),
    "a write and read of 0": ("17 0000 0000 0005 0001 02 BEEF", VALUE),
    "a write and read over the end": ("17 FFFF 0002 0005 0001 02 BEEF", ADDRESS),
}
"""PDUs that are not valid, and the exception of a server that knows the function."""
CLOSED = {
    "length 0": "0001 0000 0000 01",
    "length 1": "0001 0000 0001 01",
    "length 255, a request of 254 bytes": "0001 0000 00FF 01 03" + " 00" * 253,
    "length 256": "0001 0000 0100 01 03 0000 0001",
    "length 65535": "0001 0000 FFFF 01 03 0000 0001",
    "a web browser": b"GET / HTTP/1.1\r\nHost: plc\r\n\r\n".hex(),
    "TLS": "1603 0102 0001 0001 FC 03 03",
    "FF and nothing else": "FF" * 300,
}
"""Streams that are no Modbus: they end the connection, and a valid write behind them is not executed."""


def frame(pdu: str, transaction: int = 1, protocol: int = 0) -> bytes:
    data = bytes.fromhex(pdu)
    return b"".join(part.to_bytes(2, "big") for part in (transaction, protocol, 1 + len(data))) + b"\1" + data


def served_again(rig: ServerRig, caller: Caller) -> None:
    """The caller asks on a new connection, whatever the last client has left."""
    caller.dial(SMALL, tries=2000)
    caller.wait_for_replies()
    caller.hang_up()


# --- what they do beside saying things that are not valid --------------------------------------------------------------


def half_a_write_then_fin(rig: ServerRig, client: Caller) -> None:
    client.say(frame(WRITE)[:-1])
    client.finish()
    rig.scan(30)
    assert (client.heard, bool(client.end)) == (b"", True)


def half_a_write_then_reset(rig: ServerRig, client: Caller) -> None:
    client.say(frame(WRITE)[:-1])
    rig.scan(2)
    client.hang_up(reset=True)


def half_a_write_for_ever(rig: ServerRig, client: Caller) -> None:
    """It says nothing more; it is left after a while where the library knows a time for that, else it leaves."""
    client.say(frame(WRITE)[:-1])
    rig.scan(6300)
    assert bool(client.end) == rig.kind.has_idle_time
    client.hang_up()


def a_byte_now_and_then(rig: ServerRig, client: Caller) -> None:
    """What never becomes a request does not count as one."""
    for byte in frame(WRITE)[:9]:
        client.say(bytes((byte,)))
        rig.scan(800)
    assert bool(client.end) == rig.kind.has_idle_time
    client.hang_up()


def a_request_then_fin(rig: ServerRig, client: Caller) -> None:
    """It gets its replies, then the end: FIN, or RST where the unit was told to linger."""
    client.ask(READ, SMALL)
    client.finish()
    rig.scan(60)
    assert client.unanswered == []
    assert client.end == ("ECONNRESET" if rig.kind is KINDS["etn_modbus"] else "FIN")


def reads_nothing_then_resets(rig: ServerRig, client: Caller) -> None:
    client.dial(*[READ] * 400, reads=False)
    rig.scan(50)
    client.hang_up(reset=True)


def connects_and_resets(rig: ServerRig, client: Caller) -> None:
    client.hang_up(reset=True)


def connects_and_leaves(rig: ServerRig, client: Caller) -> None:
    client.hang_up()


def calls_again_and_again(rig: ServerRig, client: Caller) -> None:
    for number in range(20):
        client.call()
        rig.scan(number % 4)
    client.hang_up(reset=True)


def says_it_byte_by_byte(rig: ServerRig, client: Caller) -> None:
    client.asked = [Adu(0xFFFF, 1, READ)]
    for byte in client.asked[0].to_bytes():
        client.say(bytes((byte,)))
        rig.scan()
    client.wait_for_replies()


def asks_fifty_things_at_once(rig: ServerRig, client: Caller) -> None:
    client.ask(*[READ, SMALL] * 25)
    client.wait_for_replies(scans=800)


def says_one_transaction_again_and_again(rig: ServerRig, client: Caller) -> None:
    client.asked = [Adu(0, 1, SMALL)] * 5
    client.say(b"".join(each.to_bytes() for each in client.asked))
    client.wait_for_replies()


def speaks_other_protocols_between_requests(rig: ServerRig, client: Caller) -> None:
    for protocol in (1, 0xFFFF):
        client.say(frame(WRITE, protocol=protocol))
        client.ask(SMALL)
    client.wait_for_replies()


def begins_the_next_request_behind_one(rig: ServerRig, client: Caller) -> None:
    following = Adu(7777, 1, SMALL)
    client.asked = [Adu(7776, 1, READ), following]
    client.say(client.asked[0].to_bytes() + following.to_bytes()[:5])
    rig.scan(40)
    assert client.unanswered == [following]
    client.say(following.to_bytes()[5:])
    client.wait_for_replies()


BEHAVIOUR: dict[str, Callable[[ServerRig, Caller], None]] = {
    function.__name__.replace("_", " "): function
    for function in (
        half_a_write_then_fin, half_a_write_then_reset, half_a_write_for_ever, a_byte_now_and_then, a_request_then_fin,
        reads_nothing_then_resets, connects_and_resets, connects_and_leaves, calls_again_and_again, says_it_byte_by_byte,
        asks_fifty_things_at_once, says_one_transaction_again_and_again, speaks_other_protocols_between_requests,
        begins_the_next_request_behind_one,
    )
}  # fmt: skip


# --- the tests ------------------------------------------------------------------------------------------------------------

servers = pytest.mark.parametrize("kind", KINDS)
engines = pytest.mark.parametrize("engine", ["python", pytest.param("native", marks=pytest.mark.slow)])


def rig_of(kind: str, engine: str) -> ServerRig:
    if engine == "native":
        pytest.importorskip("llvmlite")
    return ServerRig(kind, engine=engine)


@pytest.mark.slow
@servers
@engines
def test_what_is_not_valid_gets_its_exception(kind: str, engine: str) -> None:
    """One after the other on one connection, then all of them together on another."""
    rig = rig_of(kind, engine)
    client, before = rig.caller().dial(), rig.registers()
    expected = []
    for pdu, exception in INVALID.values():
        function = bytes.fromhex(pdu)[0]
        code = exception if function in rig.kind.functions else FUNCTION
        expected.append(bytes((function | 0x80, code)))
        client.ask(bytes.fromhex(pdu))
        client.wait_for_replies()
    replies = client.replies()
    assert dict(zip(INVALID, [reply.pdu for reply in replies if isinstance(reply, Adu)], strict=True)) == dict(
        zip(INVALID, expected, strict=True))  # fmt: skip
    client.dial(*[bytes.fromhex(pdu) for pdu, _ in INVALID.values()])
    client.wait_for_replies(scans=800)
    assert [reply.pdu for reply in client.replies() if isinstance(reply, Adu)] == expected
    assert (rig.registers(), client.end) == (before, "")


@pytest.mark.slow
@servers
@engines
def test_what_is_no_modbus_is_closed(kind: str, engine: str) -> None:
    rig = rig_of(kind, engine)
    client, next_client, before = rig.caller(), rig.caller(), rig.registers()
    for name, stream in CLOSED.items():
        client.dial()
        client.ask(SMALL)
        client.say(bytes.fromhex(stream) + frame(WRITE))
        rig.scan(40)
        assert (client.unanswered, bool(client.end)) == ([], True), name
        served_again(rig, next_client)
    assert rig.registers() == before


@pytest.mark.slow
@pytest.mark.parametrize("name", BEHAVIOUR)
@servers
@engines
def test_clients_that_misbehave(kind: str, name: str, engine: str) -> None:
    rig = rig_of(kind, engine)
    client, next_client, before = rig.caller().dial(), rig.caller(), rig.registers()
    BEHAVIOUR[name](rig, client)
    assert client.unanswered is not None, "and what has come is right"
    client.hang_up()
    served_again(rig, next_client)
    assert rig.registers() == before


def test_there_are_enough_of_them() -> None:
    assert len(INVALID) + len(CLOSED) + len(BEHAVIOUR) >= 50
