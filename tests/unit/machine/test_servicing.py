"""FINS and what surrounds it: journals, recordings, forks and fast paths do a run again to the bit."""

from __future__ import annotations

from datetime import datetime
from io import BytesIO, StringIO
from types import SimpleNamespace
from typing import Any, cast

import pytest
from depth import times
from fins_rig import COUNTING, FinsRig, TcpClient, compiled
from hypothesis import given, settings
from hypothesis import strategies as st
from images import counter_image
from rows import each_of

from fbvm import Plc, Recording, RecordingFile, RecordingWriter, compile_text
from fbvm.base.areas import NEVER
from fbvm.base.memory import Memory
from fbvm.machine.servicing.commands import changes, execute
from fbvm.machine.servicing.cpu import Machine
from fbvm.machine.servicing.peripheral import PeripheralServicing
from fbvm.machine.servicing.registers import Registers
from fbvm.net.journal import Journal, open_journal
from fbvm.record.recording import recording as recording_module
from fbvm.record.recording.journal_replay import Replay
from fbvm.units.contract import FinsAccess
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.fins.codes import EndCode
from fbvm.wire.fins.frames import Address, Command, Header
from fbvm.wire.link import Event

CONVERSATION = [
    (0x0102, "82 0064 00 0002 1234 5678"), (0x2301, "0001 0001 30 0064 01"), (0x0101, "82 01F4 00 0001"),
    (0x0702, "26 11 22 13 44 04 00"), (0x0402, ""), (0x0102, "31 000A 03 0001 01"), (0x0401, "FFFF 04"), (0x0620, "01"),
    (0x0C01, "FFFF"), (0x0401, ""), (0x2302, ""), (0x0701, ""), (0x0103, "82 0000 00 000A 5555"), (0x0403, ""),
]  # fmt: skip


def converse(rig: FinsRig) -> list[tuple[str, str]]:
    """The same conversation each time: UDP, TCP, a restart of the unit."""
    answers = []
    for code, parameters in CONVERSATION:
        answers.append(rig.command(code, parameters))
        rig.plc.run(scans=3)
    client = TcpClient(rig)
    client.connect()
    rig.plc.run(scans=2)
    client.say(b"FINS\0\0")
    rig.plc.run(scans=2)
    rig.command(0x0403, unit=0x10)
    rig.plc.run(scans=10)
    return answers


SIZES: dict[int, tuple[int, int, str]] = {
    0x0101: (6, 6, ""), 0x0102: (6, 2000, "changes"), 0x0103: (8, 8, "changes"), 0x0104: (0, 2000, ""),
    0x0105: (10, 10, "changes"),
    0x0401: (0, 3, "changes controls alone"), 0x0402: (0, 2, "changes controls alone"), 0x0501: (0, 1, ""), 0x0502: (1, 2, ""),
    0x0601: (0, 0, ""), 0x0620: (1, 1, ""), 0x0701: (0, 0, ""), 0x0702: (5, 7, "changes alone"), 0x0C01: (2, 2, ""),
    0x0C02: (2, 2, ""), 0x0C03: (2, 2, ""), 0x2101: (2, 2, "changes alone"), 0x2102: (4, 4, ""), 0x2103: (0, 0, "changes alone"),
    0x2301: (2, 2000, "changes"), 0x2302: (0, 0, "changes"),
}
"""Of each command the least and most bytes of parameters, and when it is refused (W342 5-3): where nothing may be changed or
nobody may change the mode, and while another device has the access right."""


@pytest.mark.parametrize("code", SIZES, ids="{:04X}".format)
def test_what_is_asked_of_a_command_before_it_is_executed(code: int) -> None:
    least, most, refused = SIZES[code]
    layout, source = counter_image().layout, Address(0, 9, 0)
    registers = Registers(Memory(layout.size, layout.areas))

    def answer(size: int, **access: bool) -> int:
        command = Command(Header(Address(), source, 1), code, bytes(size))
        try:
            return execute(cast(Machine, None), registers, command, FinsAccess(**access))[0]
        except (AttributeError, TypeError):  # it was executed, on no machine at all
            return -1

    assert answer(most + 1) == EndCode.TOO_LONG
    assert not least or answer(least - 1) == EndCode.TOO_SHORT
    assert not {answer(least), answer(most)} & {EndCode.TOO_LONG, EndCode.TOO_SHORT, EndCode.PROTECTED, EndCode.ACCESS_RIGHT}
    assert (answer(least, may_write=False) == EndCode.PROTECTED) == ("changes" in refused)
    assert (answer(least, may_control=False) == EndCode.PROTECTED) == ("controls" in refused)
    registers.right = Address(3, 5, 0x21)
    assert registers.right == Address(3, 5, 0x21)
    assert (answer(least) == EndCode.ACCESS_RIGHT) == ("alone" in refused or code == 0x0C01)  # which asks for the right
    registers.right = source
    assert answer(least) != EndCode.ACCESS_RIGHT
    assert changes(code) == ("changes" in refused)


def test_cycle_times_are_the_average_of_the_last_eight_the_longest_and_the_least() -> None:
    layout = counter_image().layout
    registers = Registers(Memory(layout.size, layout.areas))
    assert registers.cycle_times_ns == (0, 0, 0)
    seen = []
    for time_ns in (90, 10, 20, 30, 40, 50, 60, 70, 81):
        registers.measure(time_ns)
        seen.append(registers.cycle_times_ns)
    assert seen[:3] == [(90, 90, 90), (50, 90, 10), (40, 90, 10)]
    assert seen[-1] == ((10 + 20 + 30 + 40 + 50 + 60 + 70 + 81) // 8, 90, 10)
    registers.forget_cycle_times()
    assert registers.cycle_times_ns == (0, 0, 0)


@each_of("ports, clock, unit, requests, changed", [
    (None, None, False, False, False), (False, False, False, False, False), (True, False, False, False, True),
    (False, True, False, False, True), (False, False, True, False, True), (False, False, False, True, False),
    (True, True, True, True, True),
])
def test_the_program_should_see_soon_what_ports_the_clock_or_a_unit_have_changed(
        ports: bool | None, clock: bool | None, unit: bool, requests: bool, changed: bool) -> None:  # fmt: skip
    machine = SimpleNamespace(memory=compiled().memory, is_running=False, units=[])
    servicing, submitted = PeripheralServicing(cast(Any, machine), counter_image()), []
    assert not servicing.is_needed
    if ports is not None:
        servicing._ports = cast(Any, SimpleNamespace(serve=lambda now_ns, send: ports, wake_ns=7))
    if clock is not None:
        servicing._setting = cast(Any, SimpleNamespace(serve=lambda registers, now_ns: clock))
    assert servicing.is_needed == (ports is not None or clock is not None)
    assert servicing.wake_ns == (NEVER if ports is None else 7)
    one = SimpleNamespace(serve=lambda cpu, now_ns: ["send"] * requests, changed_words=unit)
    other = SimpleNamespace(serve=lambda cpu, now_ns: [], changed_words=False)
    link = SimpleNamespace(submit=lambda rows, now_ns: submitted.append((rows, now_ns)))
    servicing._units = cast(Any, [(one, SimpleNamespace(link=link)), (other, SimpleNamespace(link=link))])
    for _ in range(2):
        assert servicing.serve(5) is changed
    assert submitted == [(["send"], 5)] * 2 * requests


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["python", "auto"])
def test_a_journal_with_fins_is_done_again_to_the_bit(engine: str) -> None:
    image = compile_text(COUNTING).image
    assert image
    file = StringIO()
    journal = Journal(file)
    rig = FinsRig(plc=Plc(image, journal=journal))
    answers = converse(rig)
    assert [end_code for end_code, _ in answers] == ["0000"] * 13 + ["0401"]
    journal.close()
    header, entries = open_journal(StringIO(file.getvalue()).readlines())
    replay = Replay(header, entries, image, engine=engine)
    assert replay.run() == "end"
    assert replay.differs is None
    assert replay.complete
    assert replay.plc.memory.snapshot().pages == rig.plc.memory.snapshot().pages
    assert replay.plc.mode == rig.plc.mode


@pytest.mark.slow
def test_every_scan_of_a_recording_with_fins_is_had_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recording_module, "AGAIN_NS", 5 * recording_module.CALL_NS)
    rig, file = FinsRig(plc=compiled()), BytesIO()
    recording = Recording(file=RecordingWriter(file))
    in_memory = recording.add("plc", rig.plc)
    seen: dict[int, bytes] = {}
    rig.plc.watchers.append(lambda plc: seen.__setitem__(plc.scans, plc.memory.map[:]))
    converse(rig)
    recording.close()
    in_file = RecordingFile(BytesIO(file.getvalue()), images={"plc": rig.plc.image})["plc"]
    for recorded in (in_memory, in_file):
        for plc in recorded.again(recorded.scans):
            assert plc.memory.map[:] == seen[plc.scans], plc.scans
        for scan in (5, 20, 40, recorded.scans.stop):
            at = recorded.at(scan)
            assert at.scans == scan
            assert at.read("D100..D101") == ([0x1234, 0x5678] if scan > 4 else [0, 0])


def test_the_clock_goes_on_over_a_restart() -> None:
    rig = FinsRig()
    rig.command(0x0702, "26 11 22 13 44 04 00")
    rig.plc.cold_start()
    rig.plc.run(scans=3)
    assert rig.command(0x0701)[1].startswith("26 11 22 13 44")


def test_the_clock_of_a_plc_is_set_from_outside() -> None:
    rig = FinsRig()
    rig.plc.servicing.clock_ns = 86_400_000_000_000 * 31
    assert rig.command(0x0701) == ("0000", "00 02 01 00 00 00 02")


def date(plc: Plc) -> str:
    return " ".join(f"{plc.read(f'A{number}'):04X}" for number in (351, 352, 353, 354))


def test_a351_to_a354_show_the_clock_that_fins_sets() -> None:
    rig = FinsRig()
    assert date(rig.plc) == "0000 0100 0001 0006", "it begins on a Saturday"
    rig.command(0x0702, "24 02 28 23 59 58 03")
    rig.plc.run(scans=1)
    assert date(rig.plc) == "5958 2823 2402 0003"
    rig.plc.run(scans=200)
    assert date(rig.plc) == "0000 2900 2402 0004"


PLC_WITH_DATE = """PROGRAM Main
VAR S AT D0 : ARRAY[0..3] OF WORD := [16#3015, 16#2208, 16#2611, 0]; END_VAR
LADDER
    LD W0.00
    @DATE(735) D0
END_LADDER
END_PROGRAM"""


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["python", "native"])
def test_the_program_sets_the_clock(engine: str) -> None:
    plc = Plc(compiled(PLC_WITH_DATE).image, engine=engine)
    plc.run(scans=3)
    plc.write("W0.00", True)
    plc.run(scans=2)
    assert date(plc) == "3015 2208 2611 0000", "a Sunday"
    copy = plc.fork()
    for each in (plc, copy):
        each.run(scans=500)
        assert date(each) == "3020 2208 2611 0000"
    before = plc.snapshot()
    for place, wrong in {"D3": 7, "D2": 0x2613, "D1": 0x3108, "D0": 0x1A00}.items():
        plc.restore(before)
        plc.write(place, wrong)
        plc.write("W0.00", False)
        plc.run(scans=1)
        plc.write("W0.00", True)
        plc.run(scans=1)
        assert plc.read("P_ER") and date(plc).endswith("2208 2611 0000"), place
    for words, shown in ((0, 0x0100, 0x0001), "0000 0100 0001 0006"), ((0x5958, 0x3123, 0x9912), "5958 3123 9912 0004"):
        plc.restore(before)
        for number, word in enumerate(words):
            plc.write(f"D{number}", word)
        plc.write("W0.00", False)
        plc.run(scans=1)
        plc.write("W0.00", True)
        plc.run(scans=2)
        assert date(plc) == shown, "the first second, and a year that is 2099"


COUNTED = "PROGRAM Main VAR n : UINT; END_VAR n := n + 1; END_PROGRAM"


@pytest.mark.slow
@settings(deadline=None, max_examples=times(10))
@given(st.datetimes(datetime(2000, 1, 1), datetime(2099, 12, 31)))
def test_both_engines_show_any_date_as_the_calendar_has_it(now: datetime) -> None:
    now = now.replace(microsecond=0)
    for engine in ("python", "native"):
        plc = Plc(compiled(COUNTED).image, engine=engine)
        plc.run(scans=1)
        plc.servicing.clock_ns = int((now - datetime(2000, 1, 1)).total_seconds()) * 1_000_000_000 - plc.elapsed_ns
        plc.run(scans=3)
        assert date(plc) == now.strftime("%M%S %d%H %y%m 000%w")


@pytest.mark.slow
def test_machine_code_and_python_leave_the_same_memory_and_answers() -> None:
    rigs = {engine: FinsRig(plc=Plc(compiled().image, engine=engine)) for engine in ("python", "native")}
    found = {engine: converse(rig) for engine, rig in rigs.items()}
    assert found["python"] == found["native"]
    assert rigs["python"].plc.memory.map[:] == rigs["native"].plc.memory.map[:]


@pytest.mark.slow
def test_a_request_is_answered_beside_units_that_run_in_machine_code() -> None:
    """The request switches put the unit's program into machine code, and FINS goes on."""
    source = """PROGRAM Main
    VAR Open AT CIO1519.00 : BOOL; Done : BOOL; Port AT D30019 : UINT; Socket AT D30018 : UINT; n : UDINT; END_VAR
    IF NOT Done THEN Socket := 1; Port := 5001; Open := TRUE; Done := TRUE; END_IF; n := n + 1;
    END_PROGRAM""".replace("CIO1519", "%CIO1519")
    rig = FinsRig(plc=Plc(compiled(source).image, engine="native"))
    rig.plc.run(scans=50)
    assert rig.plc.read("CIO 1501.15") is True
    client = TcpClient(rig)
    client.connect()
    for value in range(20):
        assert rig.command(0x0102, f"82 0064 00 0001 {value:04X}") == ("0000", "")
        assert rig.plc.read("D100") == value
        assert client.frame("80 00 02 00 01 00 00 EF 00 01 01 01 82 00 64 00 00 01").endswith(f"00 00 00 {value:02X}")
    assert rig.plc.read("CIO 1523") == 1




def test_the_state_of_the_service_is_plain_data_and_comes_back_whole() -> None:
    """A connection with half a message, a learned node, events that wait: files of recordings keep only plain data."""
    rig = FinsRig()
    rig.command(0x0601)
    client = TcpClient(rig)
    client.connect()
    client.say(b"FINS\0\0")
    rig.plc.run(scans=2)
    for _ in range(300):
        rig.say(bytes.fromhex("800002000100001900010601"))
    rig.plc.scan()
    state = rig.unit.state.other[-1]
    assert state

    def is_plain(item: object) -> bool:
        if isinstance(item, tuple):
            return all(map(is_plain, item))
        return isinstance(item, bool | int | str | bytes | Event)

    assert is_plain(state)
    twin = Etn21(**rig.unit.configuration)
    twin.resume(rig.unit.state, rig.plc.memory)
    assert twin.state.other == rig.unit.state.other
