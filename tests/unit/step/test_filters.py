"""What stops a run between two scans: exception replies on the network, response codes of the unit."""

from __future__ import annotations

from pathlib import Path

import pytest
from rows import each_of
from test_debugger import debugger, done, line, where

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.net.peers import ModbusPeer
from fbvm.step.debugger import Debugger
from fbvm.step.filters import BetweenScans
from fbvm.step.position import Position
from fbvm.step.session import Session
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.link import Peer
from fbvm.wire.modbus_server import ModbusServer
from fbvm.wire.tap import TapEvent, TapKind

HOUSE = Path(__file__).resolve().parents[3]


def demo(has_peer: bool = True) -> Debugger:
    image = compile_text((HOUSE / "examples" / "demo.st").read_text(encoding="utf-8")).image
    assert image is not None

    def make() -> Plc:
        plc, network = Plc(image), LoopNetwork()
        if has_peer:
            network.place(Peer("192.168.250.1", 502), ModbusPeer(ModbusServer(refusals={3: 2})))
        plc.attach(Etn21(0, "192.168.250.21"), network)
        return plc

    return Debugger({"plc": Session.of(make)})


@pytest.mark.slow
def test_an_exception_reply_stops_the_run_forth_and_back() -> None:
    found = demo()
    found.checks = {"plc": BetweenScans({"modbus": frozenset()})}
    reached = done(found.resume(500))
    assert reached and reached.kind == "modbus" and "exception 02" in reached.reasons[0] and reached.position.step == 0
    found.session.goto(reached.position.scan + 20)
    again = done(found.reverse())
    assert again and (again.position, again.reasons) == (reached.position, reached.reasons)


@pytest.mark.slow
def test_only_the_codes_that_are_wanted_stop_it() -> None:
    found = demo()
    found.checks = {"plc": BetweenScans({"modbus": frozenset((4,))})}
    assert done(found.resume(200)) is None and found.session.here.scan == 200


@pytest.mark.slow
def test_a_response_code_of_the_unit_stops_it() -> None:
    found = demo(has_peer=False)
    found.checks = {"plc": BetweenScans({"response": frozenset()})}
    reached = done(found.resume(5000))
    assert reached and reached.kind == "response" and "Response Code is 16#" in reached.reasons[0]
    assert found.session.here == reached.position
    found.session.goto(0)
    found.checks = {"plc": BetweenScans({"response": frozenset((0x9999,))})}
    assert done(found.resume(reached.position.scan + 1)) is None


@pytest.mark.slow
def test_an_exception_between_two_units_of_one_plc_is_seen_however_tcp_cuts_it() -> None:
    """Both ends tell of each piece."""
    found = demo()
    plc = found.plcs["plc"].session.world["plc"]  # type: ignore[union-attr]
    check = BetweenScans({"modbus": frozenset()})
    check.attached(plc)
    tell = plc.units[0].network.tap
    assert tell is not None
    client, server = Peer("192.168.250.21", 1025), Peer("192.168.250.22", 502)
    for piece in (b"\0\x07\0\0\0\3\x05", b"\x83\x02"):
        tell(0, server.host, TapEvent(TapKind.DATA, server, client, True, piece, mirrored=True))
        tell(0, client.host, TapEvent(TapKind.DATA, client, server, False, piece, mirrored=True))
        tell(0, client.host, TapEvent(TapKind.DATA, client, server, True, b"\0"))
    assert check.checked(plc) and check.found == "Modbus 7, unit 5: 03 read holding registers, exception 02 illegal data address"
    assert not check.checked(plc)


def late_scans(wanted: frozenset[int], *began_ms: int) -> list[str]:
    """What the filter says of scans that began at these times, the cycle being 10 ms."""
    image = compile_text("PROGRAM Main\nVAR n : INT; END_VAR\nn := n + 1;\nEND_PROGRAM\n").image
    assert image is not None
    plc, check = Plc(image, 10_000_000), BetweenScans({"late": wanted})
    check.attached(plc)
    said = []
    for at_ms in began_ms:
        plc.scan(at_ms * 1_000_000)
        if check.checked(plc):
            said.append(check.found)
    return said


def test_a_scan_that_begins_too_late_stops_the_run() -> None:
    assert late_scans(frozenset((5,)), 0, 10, 24, 39, 55, 65) == ["scan 3 began 5ms late", "scan 4 began 6ms late"]
    assert late_scans(frozenset(), 0, 10, 29, 49, 59) == ["scan 3 began 10ms late"]
    assert late_scans(frozenset((1,)), 0, 10, 20, 30) == []


class SomeScans:
    """Stops a run behind scans, and says which one it was."""

    found, kind = "", "some"

    def __init__(self, *scans: int) -> None:
        self._scans = scans

    def attached(self, plc: Plc) -> None:
        """Another PLC executes the scans."""

    def checked(self, plc: Plc) -> bool:
        if plc.scans in self._scans:
            self.found = f"{plc.scans} scans"
        return plc.scans in self._scans


@pytest.mark.slow
@each_of(("scans", "condition", "stops"), [
    ((2, 3, 5), "", [(5, 0), (3, 0), (2, 0)]),
    ((5,), "Main.N = 5", [(5, 0), (4, 1)]), ((2, 5), "Main.N = 5", [(5, 0), (4, 1), (2, 0)]),
])  # fmt: skip
def test_back_from_a_stop_between_two_scans_it_goes_to_the_stop_before_it(
    scans: tuple[int, ...], condition: str, stops: list[tuple[int, int]]
) -> None:
    found = debugger()
    done(found.scan(7))
    found.checks = {"plc": SomeScans(*scans)}
    found.here.put([line("text.st:14", condition)] * bool(condition))
    for scan, step in stops:
        reached = done(found.reverse())
        assert reached and reached.position == found.session.here == Position(scan, step)
        assert (reached.kind, reached.reasons) == ("some", (f"{scan} scans",)) or step
    assert done(found.reverse()) is None and found.session.here == Position()


def test_back_over_from_a_trap_inside_a_block_goes_to_its_call() -> None:
    found = debugger("FUNCTION_BLOCK F\nVAR z : INT; END_VAR\n    z := 0;\n    z := 1 / z;\nEND_FUNCTION_BLOCK\n"
                     "PROGRAM Main\nVAR b : F; n : INT; END_VAR\n    n := 1;\n    b();\nEND_PROGRAM\n")  # fmt: skip
    reached = done(found.resume())
    assert reached and reached.kind == "trap" and found.session.statement is None
    found.back_over()
    assert where(found) == (0, 9)
