"""SEND, RECV and CMND between two PLCs on a network in memory: flags, control words, retries, end codes."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from fbvm import Plc, compile_text
from fbvm.net.faults import Fault
from fbvm.net.loop import LoopNetwork
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.link import Peer
from fbvm.wire.tap import TapKind

HERE, THERE = "192.168.250.1", "192.168.250.2"
IDLE = "PROGRAM Main VAR n AT D9000 : UINT; END_VAR n := n + 1; END_PROGRAM"
NODE_2 = 0x0200
"""Control word C+2: node 2, CPU unit."""


def program(steps: str) -> str:
    """A program whose `go` starts a step once, and which copies the error flag to D900.00."""
    return f"""PROGRAM Main
    VAR go : BOOL; END_VAR
    LADDER
    LD go
    {steps}
    LD P_ER
    OUT D900.00
    END_LADDER
    END_PROGRAM"""


class Pair:
    """`one` executes the step, `other` is node 2; both scan in turn."""

    def __init__(self, steps: str, *, fins: bool = True, other: bool = True, **unit: object) -> None:
        compilation = compile_text(program(steps))
        assert compilation.image, [str(found) for found in compilation.diagnostics]
        idle = compile_text(IDLE).image
        assert idle
        self.network = LoopNetwork()
        self.one, self.other = Plc(compilation.image), Plc(idle)
        self.one.attach(Etn21(0, HERE, fins=fins, **unit), self.network)  # type: ignore[arg-type]
        if other:
            self.other.attach(Etn21(0, THERE, fins=True), self.network)
        self.has_other = other
        self.scan(3)

    def scan(self, times: int = 1) -> None:
        for _ in range(times):
            self.one.scan()
            if self.has_other:
                self.other.scan()

    def control(self, first: int, words: Sequence[int]) -> None:
        self.one.write(f"D{first}..D{first + len(words) - 1}", list(words))

    def go(self, scans: int = 6) -> None:
        self.one.write("Main.go", True)
        self.scan(scans)

    def enabled(self, port: int) -> bool:
        return bool(self.word(202) >> port & 1)

    def word(self, number: int) -> int:
        value = self.one.read(f"A{number}")
        assert isinstance(value, int)
        return value


@pytest.mark.slow
def test_send_writes_words_into_another_plc() -> None:
    pair = Pair("@SEND D100 D200 D0")
    pair.control(0, [3, 0, NODE_2, 0x0200, 0])
    pair.one.write("D100..D102", [1, 2, 3])
    assert pair.word(202) == 0x80FF
    pair.go()
    assert pair.other.read("D200..D203") == [1, 2, 3, 0]
    assert (pair.word(202), pair.word(219), pair.word(205)) == (0x80FF, 0, 0)


@pytest.mark.slow
def test_recv_reads_words_of_another_plc() -> None:
    pair = Pair("@RECV W5 D300 D10")
    pair.control(10, [2, 0, NODE_2, 0x0700, 0])
    pair.other.write("W5..W6", [0x1234, 0x5678])
    pair.go()
    assert pair.one.read("D300..D302") == [0x1234, 0x5678, 0]
    assert (pair.word(202), pair.word(219), pair.word(210)) == (0x80FF, 0, 0)


@pytest.mark.slow
def test_cmnd_sends_a_command_and_stores_the_response() -> None:
    """0402 stops the other PLC; its answer is the command's code and 0000."""
    pair = Pair("@CMND D100 D200 D0")
    pair.control(0, [2, 4, 0, NODE_2, 0, 0])
    pair.one.write("D100", 0x0402)
    pair.one.write("D200..D202", [0xFFFF] * 3)
    pair.go()
    assert pair.one.read("D200..D202") == [0x0402, 0, 0xFFFF]
    stood = pair.other.read("D9000")
    pair.scan(3)
    assert pair.other.read("D9000") == stood


@pytest.mark.slow
def test_flags_of_a_port_over_the_scans() -> None:
    """The chart of W340 p1031: the port is in use from the instruction to the response, and the end code is there with it."""
    pair = Pair("@RECV D9000 D300 D10")
    pair.control(10, [1, 0, NODE_2, 0x0100, 0])
    pair.one.write("A204", 0x1234)
    pair.one.write("A219", 2)
    pair.one.write("Main.go", True)
    rows = []
    for _ in range(5):
        pair.one.scan()
        rows.append((pair.word(202), pair.word(204), pair.word(219), pair.one.read("D300") != 0))
        pair.other.scan()
    assert rows == [(0x80FD, 0, 0, False), (0x80FF, 0, 0, True)] + [(0x80FF, 0, 0, True)] * 3


@pytest.mark.slow
@pytest.mark.parametrize(("limit", "retries", "scans"), [(1, 0, 10), (1, 2, 30), (0, 0, 200), (5, 1, 100)])
def test_without_a_response_the_command_is_repeated_and_ends_in_0205(limit: int, retries: int, scans: int) -> None:
    pair = Pair("@SEND D100 D200 D0")
    datagrams = []
    pair.network.tap = lambda now_ns, unit, event: datagrams.append(event) if event.out else None
    pair.network.faults.append(Fault(silent=True))
    pair.control(0, [1, 0, NODE_2, 0x0300 | retries, limit])
    pair.go(scans)
    assert not pair.enabled(3)
    pair.scan()
    assert pair.enabled(3)
    assert (pair.word(206), pair.word(219)) == (0x0205, 8)
    assert len(datagrams) == 1 + retries
    assert len({event.data for event in datagrams}) == 1


@pytest.mark.slow
def test_a_repeated_command_that_is_answered_is_good() -> None:
    pair = Pair("@SEND D100 D200 D0")
    pair.network.faults.append(Fault(silent=True))
    pair.control(0, [1, 0, NODE_2, 0x0003, 2])
    pair.one.write("D100", 77)
    pair.go(10)
    pair.network.faults.clear()
    pair.scan(30)
    assert (pair.other.read("D200"), pair.enabled(0), pair.word(203), pair.word(219)) == (77, True, 0, 0)


@pytest.mark.slow
def test_the_end_code_of_the_other_plc_is_an_error_of_send_and_none_of_cmnd() -> None:
    send = Pair("@SEND D100 A0 D0")
    send.control(0, [1, 0, NODE_2, 0, 0])
    send.go()
    assert (send.word(203), send.word(219)) == (0x2101, 1)
    cmnd = Pair("@CMND D100 D200 D0")
    cmnd.control(0, [10, 40, 0, NODE_2, 0, 0])
    cmnd.one.write("D100..D104", [0x0102, 0xB300, 0, 1, 0x7777])
    cmnd.go()
    assert cmnd.word(219) == 0
    assert cmnd.one.read("D200..D201") == [0x0102, 0x2101]


@pytest.mark.slow
def test_a_response_for_which_there_is_no_room_is_not_stored_assumed() -> None:
    pair = Pair("@CMND D100 D200 D0")
    pair.control(0, [8, 4, 0, NODE_2, 0x0200, 0])
    pair.one.write("D100..D103", [0x0101, 0x8200, 0, 2])
    pair.go()
    assert (pair.word(205), pair.word(219)) == (0x110B, 4)
    assert pair.one.read("D200..D201") == [0, 0]


@pytest.mark.slow
def test_an_odd_number_of_bytes_leaves_the_low_byte_of_the_last_word() -> None:
    pair = Pair("@CMND D100 D200 D0")
    pair.other.write("W0", 0x0001)
    pair.control(0, [8, 40, 0, NODE_2, 0, 0])
    pair.one.write("D100..D103", [0x0101, 0x3100, 0, 1])
    pair.one.write("D202", 0xAAAA)
    pair.go()
    assert pair.one.read("D200..D202") == [0x0101, 0, 0x01AA]


@pytest.mark.slow
def test_a_broadcast_needs_no_response_and_reaches_every_node() -> None:
    pair = Pair("@SEND D100 D200 D0")
    pair.one.write("D100", 5)
    pair.control(0, [1, 0, 0xFF00, 0, 0])
    pair.go()
    assert (pair.word(203), pair.word(219)) == (0x1005, 1)
    pair = Pair("@SEND D100 D200 D0")
    pair.one.write("D100", 5)
    pair.control(0, [1, 0, 0xFF00, 0x8000, 0])
    pair.go(2)
    assert (pair.other.read("D200"), pair.enabled(0), pair.word(203)) == (5, True, 0)


@pytest.mark.slow
def test_without_a_response_wanted_the_port_is_free_at_once() -> None:
    pair = Pair("@SEND D100 D200 D0", other=False)
    pair.control(0, [1, 0, NODE_2, 0x8000, 0])
    pair.go(1)
    assert (pair.enabled(0), pair.word(203), pair.word(219)) == (True, 0, 0)


@pytest.mark.slow
@pytest.mark.parametrize("node", [0, 1])
def test_node_0_and_the_own_node_are_this_plc(node: int) -> None:
    pair = Pair("@SEND D100 D200 D0", other=False)
    pair.one.write("D100", 9)
    pair.control(0, [1, 0, node << 8, 0, 0])
    pair.go(1)
    assert (pair.one.read("D200"), pair.enabled(0), pair.word(203)) == (9, True, 0)


@pytest.mark.slow
def test_the_own_unit_echoes_to_cmnd() -> None:
    pair = Pair("@CMND D100 D200 D0", other=False)
    pair.control(0, [4, 40, 0, 0x0010, 0, 0])
    pair.one.write("D100..D101", [0x0801, 0x1234])
    pair.go(1)
    assert pair.one.read("D200..D202") == [0x0801, 0, 0x1234]


@pytest.mark.slow
@pytest.mark.parametrize(("control", "end_code", "fins"), [
    ([1, 3, NODE_2, 0, 0], 0x0502, True), ([1, 0, NODE_2, 0, 0], 0x0101, False), ([1, 0, 0x0011, 0, 0], 0x0202, True),
    ([1, 0, 0x0010, 0, 0], 0x0202, False), ([1, 3, NODE_2, 0x8000, 0], 0x0502, True),
])  # fmt: skip
def test_where_nothing_can_be_sent(control: list[int], end_code: int, fins: bool) -> None:
    pair = Pair("@SEND D100 D200 D0", fins=fins, other=False)
    pair.control(0, control)
    pair.go(1)
    assert (pair.word(203), pair.word(219)) == (end_code, 1)


@pytest.mark.slow
@pytest.mark.parametrize("control", [[991, 0, NODE_2, 0, 0], [1, 0x80, NODE_2, 0, 0], [1, 0x1000, NODE_2, 0, 0],
                                     [1, 0, NODE_2, 0x0800, 0], [1, 0, NODE_2, 0x0E00, 0]])  # fmt: skip
def test_control_words_that_cannot_be_set_the_error_flag_assumed(control: list[int]) -> None:
    pair = Pair("SEND D100 D200 D0")
    pair.control(0, control)
    pair.go(3)
    assert pair.one.read("D900.00") is True
    assert pair.word(202) == 0x80FF
    assert pair.other.read("D200") == 0


@pytest.mark.slow
def test_a_port_in_use_sets_the_error_flag_and_goes_on_assumed() -> None:
    pair = Pair("SEND D100 D200 D0", other=False)
    pair.control(0, [1, 0, NODE_2, 0, 100])
    pair.go(2)
    assert pair.one.read("D900.00") is True
    assert (pair.enabled(0), pair.word(203), pair.word(219)) == (False, 0, 0)


@pytest.mark.slow
def test_automatic_allotment_takes_a_free_port_and_says_which() -> None:
    pair = Pair("SEND D100 D200 D0", other=False)
    pair.control(0, [1, 0, NODE_2, 0x0F00, 100])
    pair.one.write("A217", 5)
    for port in range(8):
        pair.go(1)
        assert [pair.word(number) for number in (216, 217, 218)] == [0xD800 + 203 + port, 0, port]
        assert pair.word(202) == (0xFF & 0xFF << port + 1) | 0x8000 * (port < 7)
        assert pair.one.read("D900.00") is False
    pair.scan(1)
    assert pair.one.read("D900.00") is True
    assert [pair.word(number) for number in (216, 217, 218)] == [0xD800 + 210, 0, 7], "those of the last one"


@pytest.mark.slow
def test_the_last_free_port_counts_for_automatic_allotment() -> None:
    pair = Pair("\nLD go\n".join(f"@SEND D100 D200 D{10 * port}" for port in range(1, 8)), other=False)
    for port in range(1, 8):
        pair.control(10 * port, [1, 0, NODE_2, port << 8, 100])
    pair.go(1)
    assert pair.word(202) == 0x8001


@pytest.mark.slow
@pytest.mark.parametrize("words", ["own D200", "D100 own"])
@pytest.mark.parametrize("name", ["SEND", "RECV", "CMND"])
def test_words_without_an_address_are_an_error_and_no_port_is_allotted(name: str, words: str) -> None:
    """Those of a variable that the program does not place."""
    compilation = compile_text(program(f"{name} {words} D0").replace("go : BOOL;", "go : BOOL; own : ARRAY[0..7] OF WORD;"))
    assert compilation.image, [str(found) for found in compilation.diagnostics]
    plc = Plc(compilation.image)
    plc.attach(Etn21(0, HERE, fins=True), LoopNetwork())
    plc.write("D0..D5", [2, 4, 0, 0, 0x0F00, 0] if name == "CMND" else [1, 0, 0, 0x0F00, 0, 0])
    plc.write("Main.go", True)
    plc.scan()
    assert plc.read("D900.00") is True
    assert (plc.read("A202"), plc.read("A216")) == (0x80FF, 0)


@pytest.mark.slow
def test_ports_are_free_from_the_beginning() -> None:
    """In the first cycle, too."""
    compilation = compile_text("PROGRAM Main\nLADDER\nLD P_On\nMOV A202 D900\nSEND D100 D200 D0\nEND_LADDER\nEND_PROGRAM")
    assert compilation.image
    plc = Plc(compilation.image)
    plc.scan()
    assert plc.read("D900") == 0x80FF


@pytest.mark.slow
def test_a_stop_of_the_own_plc_frees_its_ports() -> None:
    pair = Pair("@SEND D100 D200 D0", other=False)
    pair.control(0, [1, 0, NODE_2, 0, 100])
    pair.go(2)
    assert not pair.enabled(0)
    pair.one.mode = type(pair.one.mode).PROGRAM
    pair.one.mode = type(pair.one.mode).RUN
    pair.scan(1)
    assert pair.enabled(0)


@pytest.mark.slow
@pytest.mark.parametrize("steps", ["@SEND D100 D200 D0", "@RECV D100 D200 D0"])
def test_a_node_with_a_connection_by_tcp_is_asked_over_it(steps: str) -> None:
    pair = Pair(steps, fins_clients={"2": f"{THERE}:9600"})
    datagrams: list[bytes] = []
    pair.network.tap = lambda now_ns, unit, event: datagrams.append(event.data) if event.kind is TapKind.UDP else None
    pair.control(0, [2, 0, NODE_2, 0x0200, 0])
    writer, reader = (pair.one, pair.other) if "SEND" in steps else (pair.other, pair.one)
    writer.write("D100..D101", [11, 12])
    pair.scan(400)
    assert pair.one.read("CIO 1523") == 2
    assert pair.other.read("CIO 1523") == 1
    pair.go(8)
    assert reader.read("D200..D201") == [11, 12]
    assert (pair.word(202), pair.word(219), pair.word(205)) == (0x80FF, 0, 0)
    assert datagrams == []


@pytest.mark.slow
def test_a_connection_by_tcp_that_breaks_lets_the_command_go_by_udp_assumed() -> None:
    """The command on its way is lost with the connection, and repeated by what leads to the node then."""
    pair = Pair("@SEND D100 D200 D0", fins_clients={"2": THERE})
    pair.scan(400)
    pair.control(0, [1, 0, NODE_2, 0x0201, 10])
    pair.one.write("D100", 13)
    pair.network.faults.append(Fault(reset=True))
    pair.go(2)
    pair.network.faults.clear()
    pair.scan(200)
    assert pair.other.read("D200") == 13
    assert (pair.word(202), pair.word(219), pair.word(205)) == (0x80FF, 0, 0)


@pytest.mark.slow
def test_an_alarm_of_the_other_plc_is_no_error_of_recv_assumed() -> None:
    pair = Pair("@RECV D100 D200 D0", other=False)
    other = Plc(pair.other.image)
    other.attach(Etn21(0, THERE, fins=True, fins_error_flags=True), pair.network)
    pair.other, pair.has_other = other, True
    other.write("A402", 0x8000)
    other.write("D100", 17)
    pair.control(0, [1, 0, NODE_2, 0, 0])
    pair.scan(3)
    pair.go()
    assert (pair.one.read("D200"), pair.word(203), pair.word(219)) == (17, 0x0040, 0)


def test_a_node_elsewhere_is_found_by_the_address_table() -> None:
    pair = Pair("@SEND D100 D200 D0", fins_nodes={"7": f"{THERE}:9600"})
    pair.one.write("D100", 8)
    pair.control(0, [1, 0, 0x0700, 0x8000, 0])
    sent: list[Peer] = []
    pair.network.tap = lambda now_ns, unit, event: sent.append(event.remote)
    pair.go(1)
    assert sent[0] == Peer(THERE, 9600)


@pytest.mark.slow
def test_e_banks_timers_and_indirect_addresses_are_operands() -> None:
    pair = Pair("@SEND T5 E0_7 D0\nLD go\n@SEND @D50 H5 D10")
    pair.control(0, [1, 0, NODE_2, 0, 0])
    pair.control(10, [1, 0, 0, 0x0100, 0])
    pair.one.write("T5", 55)
    pair.one.write("D50", 60)
    pair.one.write("D60", 66)
    pair.go()
    assert pair.word(203) == 0x1101, "the other PLC has no E bank"
    assert pair.one.read("H5") == 66
