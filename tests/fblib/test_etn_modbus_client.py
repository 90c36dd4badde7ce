"""The client program: the request of its user, every end that a command may have, and the server as its peer."""

from __future__ import annotations

from array import array
from collections.abc import Callable
from pathlib import Path

import pytest
from depth import times
from etn_modbus_rig import SECOND_NS, image_of
from hypothesis import given, settings
from hypothesis import strategies as st
from rows import each_of, first_quick

from fbvm import compile_files
from fbvm.machine.plc import Mode, Plc
from fbvm.net.faults import Fault
from fbvm.net.loop import LoopNetwork
from fbvm.net.misdeeds import MISDEEDS, RUDE_PEERS
from fbvm.net.peers import Action, Fin, ModbusPeer, Say, ScriptedPeer, Station
from fbvm.record.draw.chart import chart
from fbvm.units.etn21.unit import Etn21
from fbvm.units.etn21.unit import Fault as UnitFault
from fbvm.wire.link import Peer
from fbvm.wire.modbus import Adu

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
SERVER = Peer("192.168.250.1", 502)
TIMINGS = pytest.mark.parametrize("timing", ["exact", pytest.param("real", marks=pytest.mark.slow)])
TEXT = """
PROGRAM Main
VAR
    Client : ETN_Modbus_Client;
    Request : ARRAY[0..252] OF BYTE;
    Octet : UINT := 192;
    Command : BOOL;
    Connect : BOOL := TRUE;
    Size : UINT;
    Id : BYTE := 16#FF;
END_VAR
    Client(IP_Address1 := Octet, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := 1, Connect := Connect,
           Command := Command, PDU := Request, PDU_Size := Size, Unit_ID := Id);
END_PROGRAM
"""


class Rig:
    """The client block on a PLC, and somebody at 192.168.250.1 port 502 (None: nobody)."""

    def __init__(self, peer: Station | None = None, *, timing: str = "exact", seed: int = 0) -> None:
        self.peer = peer if isinstance(peer, ModbusPeer) else ModbusPeer()
        self.network = LoopNetwork(seed)
        if peer:
            self.network.place(SERVER, peer)
        self.unit = Etn21(0, "192.168.250.2", timing=timing, seed=seed)
        self.plc = Plc(image_of(TEXT))
        self.plc.attach(self.unit, self.network)

    def scan(self, count: int = 1) -> None:
        for _ in range(count):
            assert self.plc.scan() is None

    def until(self, condition: str, max_s: float = 20) -> float:
        """Seconds that it took."""
        start_ns = self.plc.now_ns
        assert self.plc.run(until=condition, max_ns=int(max_s * SECOND_NS)) == "until", condition
        return (self.plc.now_ns - start_ns) / SECOND_NS

    def connect(self) -> Rig:
        self.until("Main.Client.Connected")
        return self

    def command(self, pdu: bytes) -> None:
        """Give the command; its end is another matter."""
        for number, byte in enumerate(pdu):
            self.plc.write(f"Main.Request[{number}]", byte)
        self.plc.write("Main.Size", len(pdu))
        self.plc.write("Main.Command", True)
        self.scan()
        self.plc.write("Main.Command", False)

    def ask(self, pdu: str | bytes, max_s: float = 20) -> str:
        """Reply in hexadecimal, or the error code if there is none."""
        self.command(bytes.fromhex(pdu) if isinstance(pdu, str) else pdu)
        self.until("Main.Client.Done OR Main.Client.Error", max_s)
        error, code = self.plc.read("Main.Client.Error"), self.plc.read("Main.Client.Error_Code")
        assert error == (code != 0) != self.plc.read("Main.Client.Done")
        return f"error {code:04X}" if code else self.reply()

    def reply(self) -> str:
        size = self.plc.read("Main.Client.Reply_Size")
        return bytes(self.plc.read("Main.Client.Reply")[:size]).hex(" ").upper()  # type: ignore[index, misc]

    def counters(self) -> list[int]:
        return [*self.plc.read("W491..W495")]  # type: ignore[misc, list-item]


def answering(reply: Callable[[bytes], list[Action]]) -> ModbusPeer:
    return ModbusPeer(None, reply)


@pytest.mark.slow
@pytest.mark.parametrize("timing", ["exact", "real"])
def test_the_sheets_own_request(timing: str) -> None:
    """03 for several D registers, byte for byte on the wire."""
    rig = Rig(ModbusPeer(), timing=timing).connect()
    rig.peer.server.holding_registers[1000:1003] = array("H", [0xAB12, 0x5678, 0x9713])
    assert rig.ask("03 03 E8 00 03") == "03 06 AB 12 56 78 97 13"
    assert rig.peer.received == [bytes.fromhex("00 01 00 00 00 06 FF 03 03 E8 00 03")]
    assert rig.plc.read("CIO 5804..CIO 5808") == [0xFF03, 0x06AB, 0x1256, 0x7897, 0x1300]
    assert rig.counters() == [0, 1, 1, 0, 0]


def test_a_request_scan_by_scan() -> None:
    rig = Rig(ModbusPeer()).connect()
    rig.plc.write("Main.Size", 5)
    rig.plc.write("Main.Request[0]", 3)
    rig.plc.write("Main.Request[4]", 1)
    rig.plc.write("Main.Command", True)
    signals = [("CIO 1519.03", "Send"), ("CIO 1519.04", "Receive"), "Main.Client.Done", "W492", "W493"]
    assert chart(rig.plc, 6, signals) == """
        CIO1519.03        #.....       Send
        CIO1519.04        ..#...       Receive
        Main.Client.Done  ....##
        W492              |   |0001h   = 0000h, 0001h
        W493              | |0001h     = 0000h, 0001h
    """  # fmt: skip


@pytest.mark.slow
@each_of("size", [1, 2, 3, 4, 5, 6, 100, 251, 252, 253])
def test_requests_and_replies_of_any_size(size: int) -> None:
    rig = Rig(answering(lambda frame: [Say(heard())])).connect()

    def heard() -> bytes:
        return rig.peer.received[-1]

    pdu = bytes((0x41 + value) & 0xFF for value in range(size))
    assert rig.ask(pdu) == pdu.hex(" ").upper()
    assert rig.peer.received == [Adu(1, 255, pdu).to_bytes()]


def test_exceptions_of_the_server() -> None:
    rig = Rig(ModbusPeer()).connect()
    got = [rig.ask(pdu) for pdu in ("2C", "03 FF FF 00 02", "03 00 00 00 00")]
    assert got == ["error 0001", "error 0002", "error 0003"]
    assert rig.reply() == "83 03"
    assert rig.counters() == [3, 3, 3, 0, 0]
    assert rig.ask("08 00 00 12 34") == "08 00 00 12 34"


JUDGE = "PROGRAM Main VAR judged, size : UINT; END_VAR judged := ETN_Modbus_Judge(Size := size); END_PROGRAM"


@each_of(("request", "reply", "judged"), [
    # what is read: as many bytes as were asked for
    ("03 00 00 00 02", "03 04 11 11 22 22", 0), ("03 00 00 00 02", "03 02 11 11", None),
    ("04 00 00 00 02", "04 04 11 11 22 22 33", None), ("03 00 00 00 02", "03 05 11 11 22 22", None),
    ("01 00 00 00 09", "01 02 FF 01", 0), ("02 00 00 00 08", "02 01 FF", 0), ("01 00 00 00 09", "01 01 FF", None),
    ("02 00 00 00 08", "02 02 FF FF", None), ("03 00 00 80 01", "03 02 00 00", None), ("03 00 00 00 02 00", "03 02 11 11", 0),
    ("03 00 00 00", "03 02 11 11", 0),  # no requests of the specification
    ("17 00 00 00 01 00 00 00 00 00", "17 02 00 00", 0), ("17 00 00 00 01 00 00 00 00 00", "17 04 00 00 00 00", None),
    ("17 00 00 00 01 00 00 00 00", "17 04 00 00 00 00", 0),
    # what is written: the beginning of the request
    ("05 00 22 FF 00", "05 00 22 FF 00", 0), ("05 00 22 FF 00", "05 00 23 FF 00", None),
    ("05 00 22 FF 00", "05 00 22 00 00", None), ("06 00 22 12 34", "06 00 22 12 35", None),
    ("06 00 22 12 34", "06 00 22 12 34 00", None), ("06 00 22 12 34", "06 00 22 12", None), ("06 00 22 12 34 00", "06 00", 0),
    ("0F 00 00 00 08 01 55", "0F 00 00 00 08", 0), ("0F 00 00 00 08 01 55", "0F 00 00 00 09", None),
    ("0F 00 00 00 08 01", "0F 00 00 00 08", 0), ("10 00 00 00 01 02 12 34", "10 00 01 00 01", None),
    ("10 00 00 00 01", "10 00 01 00 01", 0), ("10 00 00 00 01 02", "10 00 01 00 01", None),
    ("16 00 04 00 F2 00 25", "16 00 04 00 F2 00 25", 0), ("16 00 04 00 F2 00 25", "16 00 04 00 F2 00 26", None),
    ("16 00 04 00 F2 00", "16 01", 0),
    # an echo of any length
    ("08 00 00 A5 37", "08 00 00 A5 37", 0), ("08 00 00 A5 37", "08 00 00 A5 38", None),
    ("08 00 00 A5 37", "08 00 00 A5", None), ("08 00 00", "08 00 00", 0), ("08 00 00", "08 00 01", None),
    ("08 00 00 A5", "08 00 00 A6", None), ("08 00 00 A5", "08 00 00 A5", 0), ("08 00", "08 01", 0),
    ("08 00 0A 00 00", "08 00 0A 12 34", 0),
    # others are compared by their function alone, exceptions by their code
    ("2B 0E 01 00", "2B 00", 0), ("41 01", "42 01", None), ("41 01", "C1 01", 1), ("41 01", "C1 0B", 11),
    ("41 01", "C1 0C", None), ("41 01", "C1 00", None), ("41 01", "C1 01 00", None), ("41 01", "C2 01", None),
    ("41", "C1", None),
])  # fmt: skip
def test_what_is_an_answer_to_a_request(request: str, reply: str, judged: int | None) -> None:
    assert _judged(Adu(7, 1, bytes.fromhex(request)).to_bytes(), Adu(7, 1, bytes.fromhex(reply)).to_bytes()) == judged


@each_of("reply", ["0008 0000 0003 01 83 02", "0007 0001 0003 01 83 02", "0007 0000 0003 02 83 02", "0107 0000 0003 01 83 02"])
def test_of_another_transaction_protocol_or_unit_there_is_no_answer(reply: str) -> None:
    asked = Adu(7, 1, bytes.fromhex("03 00 00 00 01")).to_bytes()
    assert _judged(asked, bytes.fromhex("0007 0000 0003 01 83 02")) == 2 and _judged(asked, bytes.fromhex(reply)) is None


def _judged(request: bytes, reply: bytes) -> int | None:
    """0 for the reply, an exception code, None for no answer."""
    plc = Plc(image_of(JUDGE))
    for first, frame in ((6001, request), (5801, reply)):
        for number in range(0, len(frame), 2):
            plc.write(f"CIO {first + number // 2}", int.from_bytes(frame[number : number + 2].ljust(2, b"\0"), "big"))
    plc.write("Main.size", len(reply))
    assert plc.scan() is None
    judged = int(plc.read("Main.judged"))  # type: ignore[call-overload]
    return None if judged == 0xFFFF else judged


@pytest.mark.parametrize(("unit", "sent"), [(0, 0), (1, 1), (255, 255)])
def test_the_unit_identifier(unit: int, sent: int) -> None:
    rig = Rig(ModbusPeer()).connect()
    rig.plc.write("Main.Id", unit)
    rig.ask("03 00 00 00 01")
    assert rig.peer.received[-1][6] == sent


def test_commands_that_cannot_be() -> None:
    rig = Rig(ModbusPeer())
    assert rig.ask("03 00 00 00 01") == "error 2210"
    rig.connect()
    assert rig.ask(b"") == "error 1100"
    rig.plc.write("Main.Size", 254)
    rig.plc.write("Main.Command", True)
    rig.scan()
    assert rig.plc.read("Main.Client.Error_Code") == 0x1100
    rig.plc.write("Main.Command", False)
    rig.scan()
    assert rig.peer.received == []
    rig.command(bytes.fromhex("03 00 00 00 01"))
    assert (rig.plc.read("Main.Client.Error"), rig.plc.read("Main.Client.Error_Code")) == (False, 0)


def test_a_command_while_one_runs() -> None:
    rig = Rig(answering(lambda frame: [Say(frame, SECOND_NS)])).connect()
    rig.command(bytes.fromhex("03 00 00 00 01"))
    rig.scan(5)
    rig.command(bytes.fromhex("04 00 00 00 01"))
    assert (rig.plc.read("Main.Client.Error"), rig.plc.read("Main.Client.Error_Code")) == (True, 0x110C)
    rig.until("Main.Client.Done")
    assert rig.reply() == "03 02 00 00"
    assert len(rig.peer.received) == 1


def test_an_octet_above_ff() -> None:
    rig = Rig(ModbusPeer())
    rig.plc.write("Main.Octet", 256)
    rig.scan(50)
    assert rig.plc.read("Main.Client.Error_Code") == 0x1100
    rig.plc.write("Main.Octet", 192)
    assert rig.connect().ask("08 00 00 00 01") == "08 00 00 00 01"


def test_nobody_there() -> None:
    rig = Rig()
    rig.until("Main.Client.Error")
    assert rig.plc.read("Main.Client.Error_Code") == 0x004A
    rig.network.place(SERVER, rig.peer)
    assert rig.connect().ask("08 00 00 00 01") == "08 00 00 00 01"


@pytest.mark.slow
def test_a_silent_network() -> None:
    rig = Rig(ModbusPeer())
    rig.network.faults.append(Fault(silent=True))
    assert 10 <= rig.until("Main.Client.Error") < 10.2
    assert rig.plc.read("Main.Client.Error_Code") == 0x0053
    rig.network.faults.clear()
    rig.until("Main.Client.Connected", 30)
    assert rig.ask("08 00 00 00 01") == "08 00 00 00 01"


GOOD, SILENT, GARBLED = "03 02 12 34", "error 0080", "error 0045"
ENDS = {
    "two pieces": GOOD,
    "byte by byte": GOOD,
    "twice": GOOD,
    "again later": GOOD,
    "a wrong one first": GOOD,
    "a wrong one last": GOOD,
    "garbage behind": GOOD,
    "a byte behind": GOOD,
    "a frame begun behind": GOOD,
    "the next reply, too": GOOD,
    "the next reply soon": GOOD,
    "the next exception, too": GOOD,
    "flood behind": GOOD,
    "right, then fin": GOOD,
    "right, then closed": GOOD,
    "right, then reset": GOOD,
    "illegal function": "error 0001",
    "server failure": "error 0004",
    "gateway without target": "error 000B",
    "wrong protocol": GARBLED,
    "impossible length": GARBLED,
    "length 0": GARBLED,
    "length 1": GARBLED,
    "length 255": GARBLED,
    "garbage": GARBLED,
    "garbage first": GARBLED,
    "flood": GARBLED,
    "half, then fin": "error 0081",
    "fin": "error 0081",
    "half closed": "error 0081",
    "header, then closed": "error 0081",
    "reset": "error 004B",
    "half, then reset": "error 004B",
    "one byte, then reset": "error 004B",
}
"""What a request for one register ends with, by misdeed: the PDU of a reply, or an error; all others end like silence."""
ENDS_OF_REAL = {"right, then reset": "error 004B"}
"""The misdeeds that end otherwise with the delays of timing "real": a reset throws away what was not read yet."""
QUICK_RUDE = ("nobody listens", "closes at once", "never reads", "previous reply behind", "resets in mid-request")
"""The rude servers of every run; each takes a tenth of a second."""
RUDE_ENDS = {
    "nobody listens": ["error 004A"] * 3,
    "never accepts": ["error 2210"] * 3,
    "closes at once": ["error 2210"] * 3,
    "half closes at once": ["error 2210"] * 3,
    "resets at once": ["error 2210"] * 3,
    "closes after a while": ["error 2210", GOOD, "error 2210"],
    "closes between requests": [GOOD] * 3,
    "resets between requests": [GOOD] * 3,
    "takes one connection only": [GOOD, "error 004A", "error 004A"],
    "never reads": [SILENT] * 3,
    "never reads, then resets": ["error 004B"] * 3,
    "closes in mid-request": ["error 0081"] * 3,
    "resets in mid-request": ["error 004B"] * 3,
    "hears every second request": [SILENT, GOOD, SILENT],
    "previous reply instead": [SILENT] * 3,
    "previous reply first": [GOOD] * 3,
    "previous reply behind": [GOOD] * 3,
    "speaks first": [GOOD] * 3,
    "speaks first, garbage": [GOOD] * 3,
    "drips for ever": [SILENT] * 3,
    "floods from the start": [GARBLED] * 3,
}
"""What three requests end with, each a second after the end of the one before, by server."""
RUDE_ENDS_OF_REAL = {
    "closes after a while": ["error 2210"] * 3,
    "resets between requests": ["error 004B"] * 3,
    "floods from the start": [GARBLED] * 3,
}


READ = "03 00 00 00 01"


def recovers(rig: Rig) -> None:
    """With a good server the right reply comes, at the latest after what is left of the bad one has been found out."""
    rig.network.place(SERVER, ModbusPeer(rig.peer.server))
    rig.peer.reply = lambda frame: [Say(frame)]
    rig.peer.server.holding_registers[0] = 0x4321
    for _ in range(4):
        rig.until("Main.Client.Connected", 100)
        if rig.ask(READ) == "03 02 43 21":
            return
    raise AssertionError("it does not recover")


@TIMINGS
@pytest.mark.parametrize(
    "misdeed", [pytest.param(name, marks=[pytest.mark.slow] * ("flood" in name)) for name in MISDEEDS]
)
def test_a_server_that_misbehaves(misdeed: str, timing: str) -> None:
    """What the PDU of a reply says is the user's to judge; everything around it the block's."""
    rig = Rig(ModbusPeer(None, MISDEEDS[misdeed]), timing=timing).connect()
    rig.peer.server.holding_registers[0] = 0x1234
    of_real = ENDS_OF_REAL if timing == "real" else {}
    ended = rig.ask(READ)
    assert ended == of_real.get(misdeed, ENDS.get(misdeed, SILENT))
    assert rig.counters()[3:] == [ended == "error 004B", 0], "the receive that the reset has ended"
    recovers(rig)


@pytest.mark.slow
@TIMINGS
@pytest.mark.parametrize(
    "rude", [pytest.param(name, marks=[pytest.mark.slow] * (name not in QUICK_RUDE)) for name in RUDE_PEERS]
)
def test_a_rude_server(rude: str, timing: str) -> None:
    rig = Rig(timing=timing)
    rig.peer.server.holding_registers[0] = 0x1234
    rig.network.place(SERVER, RUDE_PEERS[rude](rig.peer.server))
    ended = []
    for _ in range(3):
        rig.scan(100)
        ended.append(rig.ask(READ))
    of_real = RUDE_ENDS_OF_REAL if timing == "real" else {}
    assert ended == of_real.get(rude, RUDE_ENDS[rude])
    recovers(rig)


def test_every_misdeed_has_its_end() -> None:
    assert set(ENDS_OF_REAL) < set(ENDS) < set(MISDEEDS)
    assert set(RUDE_ENDS_OF_REAL) < set(RUDE_ENDS) == set(RUDE_PEERS)


def test_the_connection_is_opened_again_when_the_server_has_closed_it() -> None:
    rig = Rig(ModbusPeer(None, MISDEEDS["fin"])).connect()
    rig.ask("03 00 00 00 01")
    rig.peer.reply = lambda frame: [Say(frame)]
    assert rig.connect().ask("03 00 00 00 01") == "03 02 00 00"


@pytest.mark.parametrize(("port", "end"), [(0, "fin"), (502, "ECONNRESET")])
def test_a_server_that_half_closes_gets_fin(port: int, end: str) -> None:
    """RST only where the unit would keep a fixed port for a minute."""
    peer = ScriptedPeer([Say(bytes.fromhex("0001 0000 0005 FF 03 02 1234")), Fin()], farewell=())
    rig = Rig(peer)
    rig.plc.write("Main.Client.Local_Port", port)
    rig.connect()
    assert rig.ask(READ) == "03 02 12 34"
    rig.scan(10)
    assert peer.log == [end]


def test_connect_false_closes() -> None:
    rig = Rig(answering(lambda frame: [])).connect()
    rig.command(b"\3\0\0\0\1")
    rig.scan(5)
    rig.plc.write("Main.Connect", False)
    rig.until("Main.Client.Error")
    assert rig.plc.read("Main.Client.Error_Code") == 0x0081
    rig.scan(200)
    assert rig.plc.read("CIO 1509") == 0
    rig.peer.reply = lambda frame: [Say(frame)]
    rig.plc.write("Main.Connect", True)
    assert rig.connect().ask("03 00 00 00 01") == "03 02 00 00"


NAMES_OF_HAPPENINGS = ["ask", "mode", "restart", "silence", "fault", "connect"]
HAPPENINGS = st.lists(st.tuples(st.sampled_from(NAMES_OF_HAPPENINGS), st.integers(0, 12)), max_size=20)


@pytest.mark.slow
@given(st.sampled_from(["exact", "real"]), st.integers(0, 10**6), HAPPENINGS)
@settings(max_examples=times(50), deadline=None)
def test_any_life(timing: str, seed: int, happenings: list[tuple[str, int]]) -> None:
    rig = Rig(ModbusPeer(), timing=timing, seed=seed)
    for what, scans in happenings:
        match what:
            case "ask":
                rig.command(b"\3\0\0\0\1")
            case "mode":
                rig.plc.mode = Mode.PROGRAM if rig.plc.mode is Mode.RUN else Mode.RUN
            case "restart":
                attached = rig.plc.units[0]
                attached.link.submit(attached.unit.reset(rig.plc.memory), rig.plc.elapsed_ns)
            case "silence":
                rig.network.faults[:] = [] if rig.network.faults else [Fault(silent=True)]
            case "fault":
                rig.unit.faults.append(UnitFault(0x2211))
            case "connect":
                rig.plc.write("Main.Connect", not rig.plc.read("Main.Connect"))
        rig.scan(scans)
    rig.plc.mode = Mode.RUN
    rig.network.faults.clear()
    rig.unit.faults.clear()
    rig.plc.write("Main.Connect", True)
    rig.scan(100)
    rig.until("Main.Client.Connected", 100)
    rig.scan(1000)
    rig.until("Main.Client.Connected", 100)
    assert rig.ask("08 00 00 12 34") == "08 00 00 12 34"


# --- two PLCs of our own ----------------------------------------------------------------------------------------------


def plc_of(source: str | Path, network: LoopNetwork, address: str, timing: str, seed: int = 0) -> Plc:
    """A PLC with that program or example on the network."""
    if isinstance(source, Path):
        made = compile_files([source])
        assert made.image is not None and not made.diagnostics
        plc = Plc(made.image)
    else:
        plc = Plc(image_of(source))
    plc.attach(Etn21(0, address, timing=timing, seed=seed), network)
    return plc


@pytest.mark.slow
@TIMINGS
def test_the_two_programs_of_the_project(timing: str) -> None:
    network = LoopNetwork()
    server = plc_of(EXAMPLES / "server.st", network, "192.168.250.1", timing)
    client = plc_of(EXAMPLES / "client.st", network, "192.168.250.2", timing, 1)
    server.write("D1000..D1002", [0xAB12, 0x5678, 0x9713])
    for _ in range(400):
        server.scan()
        client.scan()
    assert client.read("D0..D2") == [0xAB12, 0x5678, 0x9713]
    replies = client.read("Main.Replies")
    assert isinstance(replies, int) and replies > 5
    assert server.read("W491..W495") == [0, replies, replies, 0, 0]


MTCP = """
PROGRAM Main
VAR
    conn : MTCP_ETN_Connect;
    r1 : MTCP_ETN_Fn01; r2 : MTCP_ETN_Fn02; r3 : MTCP_ETN_Fn03; r4 : MTCP_ETN_Fn04;
    w5 : MTCP_ETN_Fn05; w6 : MTCP_ETN_Fn06; w15 : MTCP_ETN_Fn0F; w16 : MTCP_ETN_Fn10;
    Step, Code : UINT;
    Done : BOOL;
END_VAR
    conn(IP_Address1 := 192, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := 1, Connect := TRUE);
    w5(EN := conn.ENO, Coil_Address := 34, Value := TRUE, Cmd_Write := Step = 1);
    w6(EN := conn.ENO, Register_Address := 2000, Value := 16#3AC5, Cmd_Write := Step = 2);
    w16(EN := conn.ENO, Register_Address := 1000, Register_Qty := 123, DataAddress_DM := 500, Cmd_Write := Step = 3);
    r1(EN := conn.ENO, Coil_Address := 20, Coil_Qty := 19, RespData_DM := 100, Cmd_Read := Step = 4);
    r2(EN := conn.ENO, Coil_Address := 20, Coil_Qty := 2000, RespData_DM := 110, Cmd_Read := Step = 5);
    r3(EN := conn.ENO, Register_Address := 999, Register_Qty := 125, RespData_DM := 300, Cmd_Read := Step = 6);
    r4(EN := conn.ENO, Register_Address := 1, Register_Qty := 2, RespData_DM := 450, Cmd_Read := Step = 7);
    w15(EN := conn.ENO, Coil_Address := 20, Coil_Qty := 10, DataAddress_DM := 500, Cmd_Write := Step = 8);
    IF conn.ENO AND (Step = 0
        OR w5.Rcv_Counter + w6.Rcv_Counter + w16.Rcv_Counter + r1.Rcv_Counter + r2.Rcv_Counter + r3.Rcv_Counter
           + r4.Rcv_Counter + w15.Rcv_Counter = Step) THEN
        Step := Step + 1;
    END_IF;
    Done := Step = 9;
    Code := w15.Error_Code;
END_PROGRAM
"""


@pytest.mark.slow
@TIMINGS
@pytest.mark.parametrize("cut", first_quick([0, 7]))
@pytest.mark.parametrize("fn0f", first_quick([False, True]))
def test_the_mtcp_etn_blocks_against_the_server_program(timing: str, cut: int, fn0f: bool) -> None:
    network = LoopNetwork(faults=[Fault(segment_bytes=cut)] if cut else [])
    text = f"PROGRAM Main VAR Server : ETN_Modbus_Server; END_VAR Server(Fn0F := {fn0f}); END_PROGRAM"
    server = plc_of(text, network, "192.168.250.1", timing)
    client = plc_of(MTCP, network, "192.168.250.2", timing, 1)
    server.write("CIO 1", 0xBCD0)
    server.write("CIO 2", 0x0052)
    client.write("D500..D622", list(range(1, 124)))
    for _ in range(6000):
        server.scan()
        client.scan()
        if client.read("Main.Done"):
            break
    assert client.read("Main.Done")
    assert server.read("D2000") == 0x3AC5
    assert server.read("D1000..D1122") == list(range(1, 124))
    assert client.read("D100..D101") == [0x6BCD, 0x0005], "CIO 2.02 has been set before"
    assert client.read("D300..D424") == [0, *range(1, 124), 0]
    assert client.read("D450..D451") == [0xBCD0, 0x0056]
    assert client.read("Main.Code") == (0 if fn0f else 1)
    assert server.read("W491..W493") == [0 if fn0f else 1, 8, 8]
    assert server.read("CIO 1") == (0x8010 if fn0f else 0xBCD0), "bits 4 to 13 of it from D500 = 0001"
