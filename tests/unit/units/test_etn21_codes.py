"""Each response code provoked: by a parameter, by the state of the socket, by the network, or by a fault."""

from __future__ import annotations

import re

import pytest
from etn21_rig import CIO, E2, SERVER, A, D, H, Rig, W
from rows import each_of

from fbvm.units.etn21.codes import ERRNO, code_of, meaning_of
from fbvm.units.etn21.map import Switch
from fbvm.units.etn21.unit import Etn21, Fault
from fbvm.wire.link import Broken, Closed, Failed, Opened, Peer, Received, Sent

OPENS = [Switch.UDP_OPEN, Switch.PASSIVE_OPEN, Switch.ACTIVE_OPEN]
TRANSFERS = [Switch.SEND, Switch.RECEIVE]


# --- 1100 ---


@each_of("switch", [*OPENS, *TRANSFERS])
@each_of("socket", [0, 9, 255])
def test_1100_socket_number(switch: Switch, socket: int) -> None:
    rig = Rig()
    rig.parameters(socket=socket, local_port=3000)
    assert rig.ask(switch) == "1100"


@pytest.mark.parametrize("switch", [Switch.UDP_OPEN, Switch.PASSIVE_OPEN])
def test_1100_local_port_0(switch: Switch) -> None:
    rig = Rig()
    rig.parameters(local_port=0)
    assert rig.ask(switch) == "1100"


@pytest.mark.parametrize("remote", [Peer("0.0.0.0", 502), Peer("192.168.250.7", 0)])
def test_1100_active_open_to_nobody(remote: Peer) -> None:
    rig = Rig()
    rig.parameters(remote=remote)
    assert rig.ask(Switch.ACTIVE_OPEN) == "1100"


@pytest.mark.parametrize("switch", TRANSFERS)
def test_1100_more_than_1984_bytes(switch: Switch) -> None:
    rig = Rig()
    rig.open()
    rig.parameters(count=1985)
    assert rig.ask(switch) == "1100"
    assert rig.result(5) == 1985


# --- 1101, 1103 ---


@each_of("switch", TRANSFERS)
@each_of("address", [(0x00, 0, 0), (0x30, 0, 0), (0xAD, 0, 0), (0xA1, 0, 0), (A, 447, 0)])
def test_1101_area_not_allowed(switch: Switch, address: tuple[int, int, int]) -> None:
    rig = Rig()
    rig.open()
    rig.parameters(count=2, address=address)
    assert rig.ask(switch) == "1101"


@each_of("switch", TRANSFERS)
@each_of(
    "address", [(CIO, 6144, 0), (CIO, 6143, 0), (W, 511, 0), (H, 511, 0), (A, 959, 0), (D, 32767, 0)]
)
def test_1101_past_the_end_of_the_area_assumed(switch: Switch, address: tuple[int, int, int]) -> None:
    rig = Rig()
    rig.open()
    rig.parameters(count=3, address=address)
    assert rig.ask(switch) == "1101"


@each_of(
    ("code", "word", "area"),
    [(CIO, 6143, "CIO"), (W, 511, "W"), (H, 511, "H"), (A, 448, "A"), (D, 32767, "D"), (0x98, 7, "E0"), (E2, 9, "E2")],
)
def test_data_reach_every_area(code: int, word: int, area: str) -> None:
    rig = Rig()
    rig.open()
    rig.scan(Received(1, b"\xab\x12"))
    rig.parameters(count=2, address=(code, word, 0))
    assert rig.ask(Switch.RECEIVE) == "0000"
    assert rig.memory.words(area)[word] == 0xAB12


@pytest.mark.parametrize("switch", TRANSFERS)
def test_1103_bit_number(switch: Switch) -> None:
    rig = Rig()
    rig.open()
    rig.parameters(count=2, address=(D, 1000, 1))
    assert rig.ask(switch) == "1103"


# --- 110C ---


@each_of("switch", [s for s in Switch if s not in (Switch.ACTIVE_OPEN, Switch.CLOSE)])
def test_110c_during_an_open_assumed(switch: Switch) -> None:
    rig = Rig()
    rig.parameters(local_port=3000)
    rig.scan(Switch.ACTIVE_OPEN)
    assert rig.ask(switch) == "110C"
    assert rig.is_on(Switch.ACTIVE_OPEN)
    rig.scan(Opened(1, 3000, SERVER))
    assert rig.code() == "0000"
    assert rig.is_open()


def test_110c_in_the_refresh_that_ends_the_service_assumed() -> None:
    """The program turned SEND ON while it saw RECEIVE still ON."""
    rig = Rig()
    rig.open()
    rig.parameters(count=2)
    rig.scan(Switch.RECEIVE)
    assert rig.scan(Switch.SEND, Received(1, b"ab")) == []
    assert (rig.code(), rig.is_on(Switch.RECEIVE), rig.is_on(Switch.SEND)) == ("0000", False, True)
    rig.scan()
    assert (rig.code(), rig.is_on(Switch.SEND)) == ("110C", False)


def test_110c_of_two_switches_the_lowest_is_served_assumed() -> None:
    rig = Rig()
    rig.open()
    rig.parameters(count=2)
    rig.scan(Switch.SEND, Switch.RECEIVE)
    rig.scan()
    assert (rig.code(), rig.is_on(Switch.SEND), rig.is_on(Switch.RECEIVE)) == ("110C", True, False)
    rig.scan(Sent(1, 2))
    assert (rig.code(), rig.is_on(Switch.SEND)) == ("0000", False)


def test_110c_of_two_switches_close_goes_first_assumed() -> None:
    rig = Rig()
    rig.open()
    rig.parameters(count=2)
    rig.scan(Switch.SEND, Switch.CLOSE)
    rig.scan(Closed(1))
    assert (rig.code(), rig.is_on(Switch.SEND), rig.is_on(Switch.CLOSE)) == ("110C", False, True)
    rig.scan()
    assert (rig.code(), rig.is_on(Switch.CLOSE)) == ("0000", False)


# --- 220F, 2210, 2606, 2607 ---


@each_of("switch", [Switch.PASSIVE_OPEN, Switch.ACTIVE_OPEN])
@each_of("area", [1, 2])
def test_220f_open_of_an_open_socket(switch: Switch, area: int) -> None:
    rig = Rig()
    rig.open()
    rig.parameters(area, local_port=3000)
    assert rig.ask(switch, area=area) == "220F"
    assert rig.is_open()


def test_220f_open_of_an_opening_socket() -> None:
    rig = Rig()
    rig.parameters(1)
    rig.scan(Switch.ACTIVE_OPEN)
    rig.parameters(2)
    assert rig.ask(Switch.ACTIVE_OPEN, area=2) == "220F"


def test_220f_same_service_from_another_area_assumed() -> None:
    rig = Rig()
    rig.open()
    rig.parameters(1, count=2)
    rig.scan(Switch.RECEIVE)
    rig.parameters(2, count=2)
    assert rig.ask(Switch.RECEIVE, area=2) == "220F"
    assert rig.is_on(Switch.RECEIVE)


@pytest.mark.parametrize("switch", [*TRANSFERS, Switch.CLOSE])
def test_2210_socket_not_open(switch: Switch) -> None:
    rig = Rig()
    rig.parameters()
    assert rig.ask(switch) == "2210"


@pytest.mark.parametrize("switch", TRANSFERS)
def test_2210_while_opening(switch: Switch) -> None:
    rig = Rig()
    rig.parameters(1)
    rig.scan(Switch.ACTIVE_OPEN)
    rig.parameters(2, count=2)
    assert rig.ask(switch, area=2) == "2210"


def test_2210_after_the_close() -> None:
    rig = Rig()
    rig.open()
    rig.close()
    assert rig.ask(Switch.CLOSE) == "2210"


def test_2210_close_of_a_socket_number_that_does_not_exist_assumed() -> None:
    rig = Rig()
    rig.parameters(socket=9)
    assert rig.ask(Switch.CLOSE) == "2210"


def test_2606_open_with_the_other_protocol() -> None:
    rig = Rig()
    rig.open(1, 1)
    rig.parameters(2, socket=1, local_port=3000)
    assert rig.ask(Switch.UDP_OPEN, area=2) == "2606"


@each_of("switch", [Switch.ACTIVE_OPEN, *TRANSFERS, Switch.CLOSE])
@each_of("socket", [2, 3])
def test_2607_area_is_bound_to_another_socket(switch: Switch, socket: int) -> None:
    rig = Rig()
    rig.open(1, 1)
    rig.open(3, 3)
    rig.parameters(1, socket=socket)
    assert rig.ask(switch) == "2607"


def test_2607_other_protocol_with_a_bound_area() -> None:
    rig = Rig()
    rig.open(1, 1)
    rig.parameters(1, socket=1, local_port=3000)
    assert rig.ask(Switch.UDP_OPEN) == "2607"


def test_an_area_is_free_again_after_the_close() -> None:
    rig = Rig()
    rig.open(1, 1)
    rig.close(1, 1)
    rig.open(2, 1)
    assert rig.status(2) == 0x8000


def test_a_failed_open_binds_nothing() -> None:
    rig = Rig()
    rig.parameters(1, socket=1)
    assert rig.ask(Switch.ACTIVE_OPEN, Failed(1, "open", "ECONNREFUSED")) == "004A"
    rig.open(2, 1)
    assert rig.status(2) == 0x8000


# --- order of the checks ---


def test_checks_come_in_this_order_assumed() -> None:
    """Each step mends the first mistake of one bad send; the code names the next one."""
    rig = Rig()
    rig.open()
    rig.unit.faults += [Fault(0x0302), Fault(0x2211)]
    bad = {"socket": 9, "count": 2000, "address": (0x30, 0, 1)}
    mends = [{}, {}, {"socket": 2}, {"socket": 1}, {"count": 2}, {"address": (D, 0, 1)}, {"address": (D, 0, 0)}]
    codes = []
    for mend in mends:
        bad |= mend
        rig.parameters(**bad)
        codes.append(rig.ask(Switch.SEND))
    assert codes == ["0302", "1100", "2607", "1100", "1101", "1103", "2211"]


# --- from the network ---


@each_of(("error", "code"), sorted(ERRNO.items()))
def test_errno_of_an_active_open(error: str, code: int) -> None:
    rig = Rig()
    rig.parameters()
    assert rig.ask(Switch.ACTIVE_OPEN, Failed(1, "open", error)) == f"{code:04X}"
    assert (rig.is_open(), rig.state()) == (False, 0)


@pytest.mark.parametrize("error", ["EADDRINUSE", "EMFILE"])
def test_errno_of_a_passive_open(error: str) -> None:
    rig = Rig()
    rig.parameters(local_port=3000)
    assert rig.ask(Switch.PASSIVE_OPEN, Failed(1, "open", error)) == f"{ERRNO[error]:04X}"


def test_errno_of_a_send() -> None:
    rig = Rig()
    rig.open()
    rig.parameters(count=2)
    assert rig.ask(Switch.SEND, Failed(1, "send", "EPIPE")) == "0020"
    assert rig.is_open()


def test_an_errno_that_the_unit_lacks_is_aborted_assumed() -> None:
    assert code_of("EUNHEARDOF") == 0x45


def test_004b_of_a_pending_receive() -> None:
    rig = Rig()
    rig.open()
    rig.parameters(count=2)
    assert rig.ask(Switch.RECEIVE, Broken(1, "ECONNRESET")) == "004B"
    assert rig.is_open()


# --- from the unit's own stack ---


def test_000d_active_open_to_the_broadcast_address() -> None:
    rig = Rig()
    rig.parameters(remote=Peer("255.255.255.255", 502))
    assert rig.ask(Switch.ACTIVE_OPEN) == "000D"


def test_004c_active_open_to_its_own_port() -> None:
    rig = Rig()
    rig.parameters(remote=Peer("192.168.250.1", 3000), local_port=3000)
    assert rig.ask(Switch.ACTIVE_OPEN) == "004C"


@each_of(
    ("switch", "port"),
    [(Switch.PASSIVE_OPEN, 21), (Switch.PASSIVE_OPEN, 9600), (Switch.ACTIVE_OPEN, 80), (Switch.UDP_OPEN, 9600)],
)
def test_0049_ports_of_the_unit_itself_assumed(switch: Switch, port: int) -> None:
    rig = Rig()
    rig.parameters(local_port=port)
    assert rig.ask(switch) == "0049"
    assert rig.status(protocol="UDP" if switch is Switch.UDP_OPEN else "TCP") == 0


# --- faults ---


def test_faults_are_used_up_in_order_by_the_requests_that_they_fit() -> None:
    rig = Rig(Etn21(faults=[Fault(0x2211, Switch.CLOSE), Fault(0x003E, socket=2), Fault(0x0302)]))
    codes = []
    for socket in (1, 2, 2):
        rig.parameters(socket=socket)
        codes.append(rig.ask(Switch.ACTIVE_OPEN, Failed(socket, "open", "ECONNREFUSED")))
    rig.parameters(socket=2)
    codes.append(rig.ask(Switch.CLOSE))
    assert codes == ["0302", "003E", "004A", "2210"]
    assert rig.unit.faults == [Fault(0x2211, Switch.CLOSE)]


def test_every_code_has_a_meaning() -> None:
    assert meaning_of(0x2607) == "parameter area is bound to another socket"
    assert meaning_of(0x004A) == "ECONNREFUSED"
    assert meaning_of(0x7777) == "unknown code"


def test_the_errors_of_the_troubleshooting_table() -> None:
    """Those of W420 8-6 p227 and W343 10-7 p210 by name; what only the host says is given the code of its BSD name."""
    table = """ESRCH 0003  ENXIO 0006  EBADF 0009  EFAULT 000E  EEXIST 0011  EINVAL 0016  EMFILE 0018  EPROTONOSUPPORT 003C
    EPROTOTYPE 003D  EISCONN 003F  ENOTCONN 0040  EALREADY 0041  EPIPE 0020  EACCES 000D  ENOBUFS 003E  ENOMEM 003E
    EMSGSIZE 0042  ENOPROTOOPT 0044  ECONNABORTED 0045  EADDRINUSE 0049  ECONNREFUSED 004A  ECONNRESET 004B
    EADDRNOTAVAIL 004C  ENETUNREACH 004E  EHOSTDOWN 004F  EHOSTUNREACH 0051  ETIMEDOUT 0053"""
    expected = dict(re.findall(r"(\w+) (\w{4})", table))
    assert {name: f"{code:04X}" for name, code in ERRNO.items()} == expected
    assert code_of("ENOSYS") == 0x45 and meaning_of(0x3C) == "EPROTONOSUPPORT" and meaning_of(0x7777) == "unknown code"
