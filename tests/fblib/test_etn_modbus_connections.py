"""Who is served when: scan by scan, one client after the other, several at once, and after anything that may happen."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from depth import times
from etn_modbus_rig import SECOND_NS, SERVER, Client, Rig, image_of
from hypothesis import given, settings
from hypothesis import strategies as st
from rows import first_quick

from fbvm.base.data import data_folder
from fbvm.machine.plc import Mode, Plc
from fbvm.net.faults import Fault
from fbvm.net.loop import LoopNetwork
from fbvm.record.draw.chart import chart
from fbvm.units.etn21.map import Layout
from fbvm.units.etn21.names import descriptions
from fbvm.units.etn21.unit import Etn21
from fbvm.units.etn21.unit import Fault as UnitFault
from fbvm.wire.link import Connect, Grant, Peer, Send
from fbvm.wire.modbus import Adu

ECHO = "08 00 00 12 34"
ECHO_FRAME = Adu(1, 255, bytes.fromhex(ECHO)).to_bytes()
TIMINGS = pytest.mark.parametrize("timing", ["exact", pytest.param("real", marks=pytest.mark.slow)])


NAMES = descriptions(Layout.of(0))


def drawn(rig: Rig, scans: int, *signals: str) -> str:
    return chart(rig.plc, scans, [(signal, NAMES.get(signal, "")) for signal in signals])


@pytest.mark.slow
def test_the_program_in_the_readme() -> None:
    readme = (data_folder("fblib") / "omron" / "etn_modbus" / "README.md").read_text(encoding="utf-8")
    text = re.search(r"```\n(PROGRAM.*?)```", readme, re.S)
    assert text is not None
    assert image_of(text[1]).tasks
    charts = re.findall(r"```\n(CIO15.*?)```", readme, re.S)
    tests = Path(__file__).read_text(encoding="utf-8").replace("\n        ", "\n")
    assert charts and all(one in tests for one in charts), "its charts are those of the tests"


@pytest.mark.slow
def test_the_port_may_be_set_by_a_declaration() -> None:
    text = "PROGRAM Main VAR Server : ETN_Modbus_Server := (Local_Port := 1502); END_VAR Server(); END_PROGRAM"
    plc = Plc(image_of(text))
    plc.attach(Etn21(0, "192.168.250.1"), LoopNetwork())
    plc.run(scans=5)
    assert plc.read("D30019") == 1502


@pytest.mark.slow
@pytest.mark.parametrize("sockets", [1, 3])
def test_words_that_another_program_has_left_hold_nobody_up(sockets: int) -> None:
    """W485 to W487 say which socket listens, receives and sends."""
    text = f"PROGRAM Main VAR Server : ETN_Modbus_Server; END_VAR Server(Sockets := {sockets}); END_PROGRAM"
    plc = Plc(image_of(text))
    plc.attach(Etn21(0, "192.168.250.1"), LoopNetwork())
    plc.write("W485..W487", [5, 6, 7])
    assert plc.run(until="CIO 1519.01", max_ns=SECOND_NS) == "until"  # passive open
    assert plc.read("W485..W487") == [1, 0, 0]


# --- scan by scan -----------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_it_closes_first_and_listens_then() -> None:
    assert drawn(Rig(), 5, "CIO 1519.01", "CIO 1519.05", "CIO 1509.15", "D30019", "D30009", "W496") == """
        CIO1519.01  ..###      TCP Passive Open Request Switch
        CIO1519.05  #....      Close Request Switch
        CIO1509.15  .....      TCP Open Flag
        D30019      0 |502     Local Port
        D30009      0 |1       TCP Connection State
        W496        | |0002h   = 0000h, 0002h
    """  # fmt: skip


def test_one_request_scan_by_scan() -> None:
    rig = Rig()
    client = rig.client()
    rig.scan(3)
    client.say(ECHO_FRAME)
    assert drawn(rig, 6, "CIO 1519.03", "CIO 1519.04", "W492", "W493", "W496") == """
        CIO1519.03  .#....      Send Request Switch
        CIO1519.04  ...###      Receive Request Switch
        W492        ||0001h     = 0000h, 0001h
        W493        |  |0001h   = 0000h, 0001h
        W496        || |0005h   = 0005h, 0007h, 0005h
    """


def test_two_requests_in_one_segment() -> None:
    rig = Rig()
    client = rig.client()
    rig.scan(3)
    client.say(2 * ECHO_FRAME)
    assert drawn(rig, 7, "CIO 1519.03", "CIO 1519.04", "W493") == """
        CIO1519.03  .#.#...       Send Request Switch
        CIO1519.04  .....##       Receive Request Switch
        W493        |  | |0002h   = 0000h, 0001h, 0002h
    """


def test_the_next_client_is_let_in_three_scans_after_the_last_has_left() -> None:
    rig = Rig()
    client = rig.client()
    rig.scan(3)
    client.leave()
    assert drawn(rig, 6, "CIO 1519.04", "CIO 1519.05", "CIO 1519.01", "CIO 1509.15") == """
        CIO1519.04  ......   Receive Request Switch
        CIO1519.05  .#....   Close Request Switch
        CIO1519.01  ...###   TCP Passive Open Request Switch
        CIO1509.15  ##....   TCP Open Flag
    """


# --- one client after the other ---------------------------------------------------------------------------------------


@pytest.mark.slow
@TIMINGS
@pytest.mark.parametrize("reset", [False, True])
def test_many_clients_in_turn(timing: str, reset: bool) -> None:
    rig = Rig(timing=timing)
    client = rig.client()
    for _ in range(30):
        assert client.ask(ECHO) == ECHO
        client.leave(reset)
        assert client.connect(tries=100), "port 502 is free at once, thanks to linger"


def test_a_second_client_is_refused_while_the_first_is_there() -> None:
    rig = Rig()
    first = rig.client()
    second = rig.client(connected=False)
    assert not second.connect(tries=50)
    assert second.end == "ECONNREFUSED"
    assert first.ask(ECHO) == ECHO
    first.leave()
    assert second.connect()
    assert second.ask(ECHO) == ECHO


@pytest.mark.slow
@TIMINGS
def test_a_client_that_vanishes_is_left_after_the_idle_time(timing: str) -> None:
    rig = Rig(timing=timing)
    first = rig.client()
    assert first.ask(ECHO) == ECHO
    rig.network.faults.append(Fault(Peer(first.link.address, 0), silent=True))
    start_ns = rig.plc.now_ns
    second = rig.client(connected=False)
    assert second.connect(tries=8000)
    assert 60 <= (rig.plc.now_ns - start_ns) / SECOND_NS < 61.5
    assert second.ask(ECHO) == ECHO


@pytest.mark.slow
def test_a_client_that_asks_now_and_then_is_not_left() -> None:
    rig = Rig("Idle_Time := T#2s")
    client = rig.client()
    for _ in range(5):
        rig.scan(180)
        assert client.ask(ECHO) == ECHO


@pytest.mark.slow
def test_the_idle_time_may_be_without_end() -> None:
    rig = Rig("Idle_Time := T#0s")
    client = rig.client()
    rig.scan(20_000)
    assert client.ask(ECHO) == ECHO


@pytest.mark.slow
@pytest.mark.parametrize("pins", ["", "Sockets := 2"])
def test_dripping_bytes_is_not_asking(pins: str) -> None:
    """A client that never ends its frame cannot hold the server."""
    rig = Rig(f"Idle_Time := T#2s{', ' if pins else ''}{pins}")
    client = rig.client()
    for byte in b"\0\1\0\0\0\xf0" + bytes(240):
        client.say(bytes((byte,)))
        rig.scan(10)
        client.fetch()
        if client.end:
            break
    assert client.end == "ECONNRESET"
    assert rig.plc.now_ns < 3 * SECOND_NS
    assert rig.client().ask(ECHO) == ECHO


@pytest.mark.slow
def test_a_client_that_does_not_take_its_replies_is_left() -> None:
    rig = Rig()
    deaf = rig.client()
    deaf.link.submit([Grant(1, 0)], rig.plc.elapsed_ns)
    request = Adu(1, 1, b"\3\0\0\0\x7d").to_bytes()
    start_ns = rig.plc.now_ns
    deaf.say(2000 * request)
    second = rig.client(connected=False)
    assert second.connect(tries=8000)
    assert (rig.plc.now_ns - start_ns) / SECOND_NS < 40
    assert second.ask(ECHO) == ECHO


@pytest.mark.parametrize("said", [b"", b"\0", b"\0\1\0\0\0\6\xff\6\0\0"])
@pytest.mark.parametrize("reset", [False, True])
@pytest.mark.parametrize("pins", ["", "Sockets := 3"])
def test_the_beginning_of_a_frame_dies_with_its_client(said: bytes, reset: bool, pins: str) -> None:
    rig = Rig(pins)
    client = rig.client()
    if said:
        client.say(said)
    rig.scan(10)
    client.leave(reset)
    assert client.connect()
    assert client.ask(ECHO) == ECHO
    assert not any(rig.words("D")[:100])


# --- who may connect --------------------------------------------------------------------------------------------------

CHOSEN = "IP_Address1 := 192, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := 9"


@pytest.mark.slow
def test_a_configured_client_is_the_only_one() -> None:
    rig = Rig(CHOSEN)
    stranger = rig.client("192.168.250.8", connected=False)
    assert not stranger.connect(tries=50)
    chosen = rig.client("192.168.250.9")
    assert chosen.ask(ECHO) == ECHO
    chosen.leave()
    assert not stranger.connect(tries=50)
    assert chosen.connect()


@pytest.mark.slow
def test_a_configured_port_is_the_only_one() -> None:
    """The sheet's own way: local and remote port 502."""
    rig = Rig("Client_Port := 502")
    assert not rig.client(connected=False).connect(tries=50)
    assert rig.client(port=502).ask(ECHO) == ECHO


@pytest.mark.slow
@pytest.mark.parametrize("pins", first_quick(["IP_Address2 := 256", "Sockets := 0", "Sockets := 9", "IP_Address4 := 65535"]))
def test_settings_that_cannot_be(pins: str) -> None:
    rig = Rig(pins)
    rig.scan(50)
    assert rig.plc.read("Main.Server.Error_Code") == 0x1100
    assert rig.plc.read("CIO 1519") == 0


def test_the_unit_tells_who_is_connected() -> None:
    rig = Rig()
    rig.client("10.1.2.3", port=50_000)
    rig.scan()
    assert rig.plc.read("D30020..D30022") == [0x0A01, 0x0203, 50_000]
    assert rig.plc.read("Main.Server.Clients") == 1


# --- several at once --------------------------------------------------------------------------------------------------


@pytest.mark.slow
@TIMINGS
@pytest.mark.parametrize("sockets", [2, 8])
def test_several_clients_at_once(timing: str, sockets: int) -> None:
    rig = Rig(f"Sockets := {sockets}", timing=timing)
    clients = [rig.client() for _ in range(sockets)]
    rig.scan(30)
    assert rig.plc.read("Main.Server.Clients") == sockets
    assert not rig.client(connected=False).connect(tries=30)
    for round_ in range(5):
        for number, client in enumerate(clients):
            client.say(Adu(round_, number, bytes.fromhex(ECHO)).to_bytes())
        for number, client in enumerate(clients):
            assert client.frames(1) == [Adu(round_, number, bytes.fromhex(ECHO))]
    clients[0].leave()
    assert clients[0].connect()
    assert clients[0].ask(ECHO) == ECHO


@pytest.mark.slow
def test_the_areas_go_from_socket_to_socket() -> None:
    """While the reply to one is sent, the request of the other is received."""
    rig = Rig("Sockets := 2")
    one, other = rig.client(), rig.client()
    rig.scan(5)
    one.say(ECHO_FRAME)
    other.say(ECHO_FRAME)
    assert drawn(rig, 10, "W486", "W487", "W496", "W497", "W493") == """
        W486  || | |0000h     = 0000h, 0001h, 0002h, 0000h
        W487  |  | | |0000h   = 0000h, 0001h, 0002h, 0000h
        W496  || | |0004h     = 0004h, 0005h, 0007h, 0004h
        W497  |  | | |0004h   = 0004h, 0005h, 0007h, 0004h
        W493  0000h| |0002h   = 0000h, 0001h, 0002h
    """


def test_half_a_frame_does_not_hold_up_the_others() -> None:
    rig = Rig("Sockets := 2")
    slow, quick = rig.client(), rig.client()
    slow.say(ECHO_FRAME[:7])
    rig.scan(10)
    for _ in range(5):
        assert quick.ask(ECHO) == ECHO
    slow.say(ECHO_FRAME[7:] + ECHO_FRAME[:3])
    rig.scan(10)
    assert quick.ask(ECHO) == ECHO
    slow.say(ECHO_FRAME[3:])
    assert slow.hear() == 2 * ECHO_FRAME


@pytest.mark.slow
def test_who_never_ends_a_frame_does_not_hold_up_the_others() -> None:
    """A byte comes in each scan, so there is always something to be received."""
    rig = Rig("Sockets := 2")
    slow, quick = rig.client(), rig.client()
    slow.say(bytes.fromhex("0001 0000 00FE 01 08 0000"))
    quick.say(ECHO_FRAME)
    for _ in range(60):
        slow.say(b"\x55")
        rig.scan()
        quick.fetch()
    assert quick.data == ECHO_FRAME


@pytest.mark.slow
def test_everybody_gets_a_turn() -> None:
    """One that asks without a pause and one that asks now and then."""
    rig = Rig("Sockets := 3")
    greedy, modest, third = rig.client(), rig.client(), rig.client()
    for _ in range(20):
        greedy.say(20 * ECHO_FRAME)
        start = rig.plc.scans
        assert modest.ask(ECHO) == ECHO
        assert third.ask(ECHO) == ECHO
        assert rig.plc.scans - start < 250


# --- whatever happens -------------------------------------------------------------------------------------------------


@TIMINGS
@pytest.mark.parametrize("pins", ["", "Sockets := 3"])
@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize("at", range(0, 16, 3))
def test_a_change_of_mode_at_any_time(timing: str, pins: str, held: bool, at: int) -> None:
    rig = Rig(pins, timing=timing)
    client = rig.client()
    rig.plc.write("A500.12", held)
    client.say(3 * ECHO_FRAME)
    rig.scan(at)
    rig.plc.mode = Mode.PROGRAM
    rig.scan(3)
    rig.plc.mode = Mode.RUN
    rig.scan(10)
    client.leave()
    assert client.connect()
    assert client.ask(ECHO) == ECHO


@TIMINGS
@pytest.mark.parametrize("pins", ["", "Sockets := 3"])
@pytest.mark.parametrize("at", range(0, 16, 3))
def test_a_restart_of_the_unit_at_any_time(timing: str, pins: str, at: int) -> None:
    rig = Rig(pins, timing=timing)
    client = rig.client()
    client.say(3 * ECHO_FRAME)
    rig.scan(at)
    attached = rig.plc.units[0]
    attached.link.submit(attached.unit.reset(rig.plc.memory), rig.plc.elapsed_ns)
    client.leave()
    assert client.connect()
    assert client.ask(ECHO) == ECHO


@TIMINGS
def test_power_off_and_on(timing: str) -> None:
    rig = Rig(timing=timing)
    client = rig.client()
    rig.plc.write("D100", 0x4711)
    client.say(ECHO_FRAME)
    rig.scan(1)
    rig.plc.warm_start()
    client.leave()
    assert client.connect()
    assert client.ask("03 00 64 00 01") == "03 02 47 11"


LEFT_OPEN = {
    "our socket listening": {"D30018": 1, "D30019": 502, "CIO 1519.01": True},
    "our socket as UDP": {"D30018": 1, "D30019": 502, "CIO 1519.00": True},
    "our area with another socket": {"D30018": 5, "D30019": 502, "CIO 1519.01": True},
    "our area with another socket as UDP": {"D30018": 3, "D30019": 700, "CIO 1519.00": True},
    "our socket with another area": {"D30038": 1, "D30039": 502, "CIO 1520.01": True},
}


@TIMINGS
@pytest.mark.parametrize("before", LEFT_OPEN)
def test_whatever_the_last_program_left_open(before: str, timing: str) -> None:
    """The requests of another program, then a change to ours."""
    rig = Rig(timing=timing)
    rig.plc.mode = Mode.PROGRAM
    for name, value in LEFT_OPEN[before].items():
        rig.plc.write(name, value)
    rig.scan(15)
    visitor = rig.client(connected=False)
    visitor.dial()
    rig.scan(15)
    rig.plc.mode = Mode.RUN
    visitor.leave()
    client = rig.client(connected=False)
    assert client.connect()
    assert client.ask(ECHO) == ECHO


@pytest.mark.parametrize("code", [0x0302, 0x0105, 0x003E, 0x0049, 0x0081, 0x220F, 0x2210, 0x2211, 0x2606, 0x2607])
@pytest.mark.parametrize("count", [1, pytest.param(12, marks=pytest.mark.slow)])
def test_any_response_code_of_the_unit(code: int, count: int) -> None:
    """So many requests in a row end with it, from each stage on."""
    for scans in (0, 2, 8):
        rig = Rig()
        client = rig.client(connected=False)
        rig.scan(scans)
        client.dial()
        rig.unit.faults += [UnitFault(code)] * count
        client.say(ECHO_FRAME)
        rig.scan(20)
        client.leave()
        assert client.connect(tries=2000)
        rig.unit.faults.clear()
        assert client.ask(ECHO) == ECHO


@pytest.mark.slow
def test_an_open_that_fails_is_told_and_tried_again_each_second() -> None:
    rig = Rig()
    rig.unit.faults += [UnitFault(0x0049)] * 5
    tries, last = 0, False
    for _ in range(950):
        rig.scan()
        now = bool(rig.plc.read("CIO 1519.01"))
        tries, last = tries + (now and not last), now
        if rig.plc.read("Main.Server.Error"):
            assert rig.plc.read("Main.Server.Error_Code") == 0x0049
    assert 4 <= tries <= 6
    assert rig.client().ask(ECHO) == ECHO
    assert rig.plc.read("Main.Server.Error_Code") == 0


OWN_WORDS = [
    *[f"05 {address:04X} FF 00" for address in range(16 * 1519, 16 * 1519 + 14)],       # request switches
    *[f"05 {address:04X} FF 00" for address in (16 * 1500 + 2, 16 * 1509, 16 * 1509 + 3, 16 * 1509 + 15)],
    *[f"05 {address:04X} 00 00" for address in (16 * 1509 + 15, 16 * 1519 + 3)],
    *[f"06 {address:04X} 12 34" for address in (30001, 30009, *range(30018, 30038))],    # parameters and state
    *[f"06 {address:04X} 00 00" for address in (30009, *range(30018, 30028))],
]  # fmt: skip


@pytest.mark.slow
@TIMINGS
@pytest.mark.parametrize("pins", ["", "Sockets := 2"])
def test_a_client_writes_into_the_words_of_the_unit(timing: str, pins: str) -> None:
    """The letter allows it; the program writes its parameters anew, and whoever closed his own socket comes again."""
    rig = Rig(pins, timing=timing)
    client = rig.client()
    for request in OWN_WORDS:
        pdu = bytes.fromhex(request)
        client.say(Adu(1, 1, pdu).to_bytes())
        data = client.hear(60)
        assert data in (b"", Adu(1, 1, pdu).to_bytes()), "the right answer or none"
        if client.end:
            assert client.connect(), request
        assert client.ask(ECHO) == ECHO, request


@pytest.mark.slow
def test_a_client_writes_all_words_of_the_unit_at_once() -> None:
    rig = Rig("Full_DM := TRUE")
    client = rig.client()
    for value in (0, 0x0101, 0x8204, 0xFFFF):
        client.say(Adu(1, 1, bytes((0x10, 0x75, 0x30, 0, 100, 200)) + 100 * value.to_bytes(2, "big")).to_bytes())
        client.hear()
        if client.end:
            assert client.connect()
        assert client.ask(ECHO) == ECHO


NAMES_OF_HAPPENINGS = ["connect", "say", "half", "leave", "reset", "mode", "restart", "silence", "fault"]
HAPPENINGS = st.lists(st.tuples(st.sampled_from(NAMES_OF_HAPPENINGS), st.integers(0, 12)), min_size=3, max_size=25)


def happen(rig: Rig, client: Client, what: str) -> None:
    match what:
        case "connect":
            client.leave()
            client.dial()
        case "say":
            client.say(ECHO_FRAME)
        case "half":
            client.say(ECHO_FRAME[:5])
        case "leave" | "reset":
            client.leave(reset=what == "reset")
        case "mode":
            rig.plc.mode = Mode.PROGRAM if rig.plc.mode is Mode.RUN else Mode.RUN
        case "restart":
            attached = rig.plc.units[0]
            attached.link.submit(attached.unit.reset(rig.plc.memory), rig.plc.elapsed_ns)
        case "silence":
            rig.network.faults[:] = [] if rig.network.faults else [Fault(silent=True)]
        case "fault":
            rig.unit.faults.append(UnitFault(0x2211))


@pytest.mark.slow
@given(st.sampled_from(["exact", "real"]), st.integers(0, 10**6), st.sampled_from(["", ", Sockets := 2"]), HAPPENINGS)
@settings(max_examples=times(80), deadline=None)
def test_any_life(timing: str, seed: int, pins: str, happenings: list[tuple[str, int]]) -> None:
    rig = Rig(f"Idle_Time := T#2s{pins}", timing=timing, seed=seed)
    clients = [rig.client(connected=False), rig.client(connected=False)]
    for number, (what, scans) in enumerate(happenings):
        happen(rig, clients[number % 2], what)
        rig.scan(scans)
    rig.plc.mode = Mode.RUN
    rig.network.faults.clear()
    rig.unit.faults.clear()
    clients[0].leave(reset=True)
    clients[1].leave(reset=True)
    assert any(is_served(clients[0]) for _ in range(3)), "who came in before all was over may be sent away once"


def is_served(client: Client) -> bool:
    """A connection and an answer."""
    if not client.connect(tries=1000):
        return False
    client.say(ECHO_FRAME)
    return client.hear() == ECHO_FRAME


def test_two_servers_on_one_network() -> None:
    network = LoopNetwork()
    rig = Rig(network=network)
    rig.plc.attach(Etn21(1, "192.168.250.7"), network)
    assert rig.client().ask(ECHO) == ECHO
    link = network.attach("192.168.250.8")
    link.submit([Connect(1, Peer("192.168.250.7", SERVER.port)), Send(1, ECHO_FRAME)], rig.plc.elapsed_ns)
    rig.scan(20)
    assert rig.counters()[1] == 1, "unit 1 is not the program's"
