"""Recordings: any scan again, plain or observed, as long as there is room; what is recorded and what it costs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from toy_unit import Echoing, Toy
from watched_run import WatchedRun, contents

from fbvm import Etn21, LoopNetwork, Plc, compile_files, compile_text
from fbvm.code.image import Image
from fbvm.engine.native import engine as native
from fbvm.machine.plc import Mode, Phase, Stopped
from fbvm.net.peers import ModbusPeer
from fbvm.record.recording import recording as module
from fbvm.record.recording.chunks import Times
from fbvm.record.recording.recording import PlcRecording, Recording
from fbvm.record.trace.observing import observing
from fbvm.run import loop
from fbvm.run.running import TimedWrite
from fbvm.wire.link import Peer
from fbvm.wire.registers import server

TEXT = """
FUNCTION_BLOCK Step VAR_INPUT Go : BOOL; END_VAR VAR_OUTPUT Count : INT; END_VAR
    IF Go THEN Count := Count + 1; END_IF;
END_FUNCTION_BLOCK
PROGRAM Main
VAR
    Steps : Step; Delay : TON; Go AT CIO 0.00 : BOOL; n : UDINT; Big : ARRAY[0..4000] OF UDINT; Left : INT := 1000;
END_VAR
    n := n + 1;
    Steps(Go := Go);
    Delay(IN := NOT Delay.Q, PT := T#70ms);
    IF Delay.Q THEN Big[n MOD 4000] := n; END_IF;
    IF 1000 / Left < 0 THEN n := 0; END_IF;
END_PROGRAM
"""
ENGINES = ["python", *(["native"] if native.available() else [])]


@pytest.fixture(scope="module")
def image() -> Image:
    image = compile_text(TEXT).image
    assert image is not None
    return image


def recorded(plc: Plc, **given: Any) -> PlcRecording:
    return Recording(**given).add("plc", plc)


def press(plc: Plc, scans: int) -> list[bytes]:
    """Executes scans one by one with inputs now and then; the memory before each."""
    seen = []
    for _ in range(scans):
        if plc.scans % 7 == 3:
            plc.write("Main.Go", not plc.read("Main.Go"))
        seen.append(contents(plc))
        plc.scan()
    return seen


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
def test_any_scan_is_found_again(image: Image, engine: str) -> None:
    plc = Plc(image, engine=engine)
    kept = recorded(plc)
    seen = press(plc, 100)
    for scan in (0, 1, 13, 50, 99):
        if scan % 7 != 3:  # what is written before a scan belongs to the scan
            assert contents(kept.at(scan)) == seen[scan]
    assert contents(kept.at(100)) == contents(plc)


def test_memory_that_is_written_by_hand_is_an_input(image: Image) -> None:
    plc = Plc(image)
    kept = recorded(plc)
    plc.run(scans=5)
    plc.memory.words("D")[77] = 5
    plc.memory.u8[-1] = 9
    plc.run(scans=5)
    assert kept.at(5).read("D77") == 0
    again = kept.at(6)
    assert (again.read("D77"), again.memory.u8[-1]) == (5, 9)


@pytest.mark.parametrize("when", ["until", "watcher"])
def test_memory_that_is_written_during_a_run_is_an_input(image: Image, when: str) -> None:
    plc = Plc(image)
    kept = recorded(plc)

    def write(*_: object) -> bool:
        if plc.scans == 5 and not plc.read("D77"):
            plc.memory.words("D")[77] = 5
        return False

    if when == "watcher":
        plc.watchers.append(write)
    plc.run(scans=10, until=write if when == "until" else None)
    assert [row.read("D77") for row in map(kept.at, range(4, 8))] == [0, 0, 5, 5]


@pytest.mark.parametrize("when", ["until", "writes", "progress"])
def test_memory_that_is_written_while_the_loop_runs_is_an_input(
    image: Image, when: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("PROGRESS_NS", "PLC_PROGRESS_NS"):
        monkeypatch.setattr(loop, name, 0)
    if when == "progress":  # once there is machine code, which may be so in any scan, many go by between two calls
        monkeypatch.setattr(Plc, "scan_many", lambda plc, most: 0)
    plc = Plc(image)
    kept = recorded(plc)

    def write(*_: object) -> bool:
        if plc.scans == 5:
            plc.memory.words("D")[77] = 5
        return False

    loop.run(plc, scans=10, until=write if when == "until" else None, progress=write if when == "progress" else None,  # type: ignore[arg-type]
             writes=[TimedWrite(plc.find("D77"), 5, 5 * plc.cycle_ns)] if when == "writes" else ())
    assert [row.read("D77") for row in map(kept.at, range(4, 8))] == [0, 0, 5, 5]


def test_what_is_not_recorded_is_said(image: Image) -> None:
    plc = Plc(image)
    kept = recorded(plc)
    with pytest.raises(ValueError, match="scan 0 is not recorded; recorded are none"):
        kept.at(0)
    assert kept.scans == range(0)
    plc.run(scans=3)
    with pytest.raises(ValueError, match="scan 4 is not recorded; recorded are 0 to 3"):
        kept.at(4)
    with pytest.raises(ValueError, match="recorded already"):
        recorded(plc)


def test_names_of_plcs_are_told_apart(image: Image) -> None:
    one, other = Plc(image), Plc(image)
    recording = Recording()
    recording.add("one", one)
    recording.add("other", other)
    with pytest.raises(ValueError, match="a PLC one is recorded already"):
        recording.add("one", Plc(image))
    one.run(scans=4)
    assert [*recording] == ["one", "other"]
    assert (recording["one"].scans, recording["other"].scans) == (range(4), range(0))


def test_nothing_is_recorded_any_more_when_it_is_closed(image: Image) -> None:
    plc, recording = Plc(image), Recording()
    kept = recording.add("plc", plc)
    plc.run(scans=5)
    recording.close()
    plc.run(scans=5)
    assert kept.scans == range(5)
    assert recorded(plc).scans == range(0)


def test_another_future_from_a_recorded_scan(image: Image) -> None:
    plc = Plc(image)
    kept = recorded(plc)
    press(plc, 20)
    twin = kept.at(3)
    assert twin.cycle_ns == plc.cycle_ns
    twin.write("Main.Go", False)
    twin.scan()
    assert (twin.read("Main.Steps.Count"), plc.read("Main.Steps.Count")) == (0, 10)


@pytest.mark.slow
def test_observed_scans_are_those_of_an_observed_run(image: Image) -> None:
    plc, twin, seen, again = Plc(image), Plc(image), WatchedRun(), WatchedRun()
    kept = recorded(plc)
    press(plc, 60)
    with observing(twin, seen):
        press(twin, 60)
    kept.follow(again, range(20, 45))
    assert again.rows == seen.rows[20:45]


@pytest.mark.slow
@pytest.mark.skipif(not native.available(), reason="llvmlite is not installed")
def test_a_period_without_inputs_takes_no_room_and_stays_in_machine_code(image: Image) -> None:
    plc, calls = Plc(image, engine="native"), []
    plc.scan()
    kept = recorded(plc)
    many = plc.scan_many
    plc.scan_many = lambda most: calls.append(most) or many(most)  # type: ignore[method-assign,func-returns-value]
    plc.run(scans=1_000_000)
    assert len(calls) < 40
    size = sum(chunk.size_bytes(None) for chunk in kept._chunks)
    assert len(kept._chunks) < 40 and size < 1_000_000
    assert kept.at(777_777).scans == 777_777


def happen(plc: Plc, number: int) -> None:
    """Nine things that are done to a PLC from outside, by their numbers."""
    match number:
        case 0:
            plc.force("Main.Go", True)
        case 1:
            plc.unforce()
        case 2:
            plc.mode = Mode.PROGRAM
        case 3:
            plc.mode = Mode.RUN
        case 4:
            plc.warm_start()
        case 5:
            plc.cold_start()
        case 6:
            plc.budget += 1000
        case 7:
            plc.write("Main.Left", 0)
        case 8:
            plc.cycle_ns = 3_000_000


@pytest.mark.slow
@pytest.mark.parametrize("again_ns", [module.AGAIN_NS, -1], ids=["one keyframe", "a keyframe before each run"])
@pytest.mark.parametrize("engine", ENGINES)
def test_whatever_is_done_between_scans_is_done_again(image: Image, engine: str, again_ns: int,
                                                      monkeypatch: pytest.MonkeyPatch) -> None:  # fmt: skip
    monkeypatch.setattr(module, "AGAIN_NS", again_ns)
    plc, twin, seen, again = Plc(image, engine=engine), Plc(image), WatchedRun(), WatchedRun()
    kept = recorded(plc)

    def run(plc: Plc) -> None:
        for number in (0, 1, 2, 3, 0, 4, 5, 6, 8, 1, 7, 4):
            plc.run(scans=5)
            happen(plc, number)
        plc.run(scans=5)

    run(plc)
    with observing(twin, seen):
        run(twin)
    assert kept.scans == range(plc.scans)
    kept.follow(again, kept.scans)
    assert again.rows == seen.rows
    assert contents(kept.at(plc.scans)) == contents(plc)


def test_a_trap_ends_the_same_scan_again(image: Image) -> None:
    plc = Plc(image)
    kept = recorded(plc)
    plc.run(scans=5)
    plc.write("Main.Left", 0)
    plc.run(scans=5)
    assert plc.trap and plc.scans == 6
    again = kept.at(6)
    assert str(again.trap) == str(plc.trap)
    with pytest.raises(Stopped):
        again.scan()


def test_a_plc_that_goes_back_is_recorded_anew_from_there(image: Image) -> None:
    plc = Plc(image)
    kept = recorded(plc)
    plc.run(scans=10)
    state = plc.snapshot()
    plc.run(scans=10)
    plc.restore(state)
    plc.write("Main.Go", True)
    plc.run(scans=3)
    assert kept.scans == range(13)
    assert kept.at(13).read("Main.Steps.Count") == 3
    assert kept.at(9).read("Main.n") == 9


def test_a_scan_that_did_not_end_can_be_followed_to_its_end(image: Image) -> None:
    class Enough(Exception):
        pass

    class Interrupting(WatchedRun):
        def event(self, plc: Plc, event: Any) -> None:
            if plc.scans == 4:
                raise Enough

    plc, again = Plc(image), WatchedRun()
    kept = recorded(plc)
    with observing(plc, Interrupting()):
        plc.run(scans=4)
        plc.write("Main.Go", True)
        with pytest.raises(Enough):
            plc.scan()
    assert kept.scans == range(4)
    kept.follow(again, range(4, 5))
    assert again.rows[0][:2] == (4, 40_000_000)
    assert [done.read("Main.Steps.Count") for done in kept.again(range(4, 5))] == [1], "with the input that it was given"
    plc.run(scans=2)
    assert contents(kept.at(6)) == contents(plc)


def test_a_scan_that_stood_at_a_breakpoint_does_not_lead_astray(image: Image) -> None:
    plc = Plc(image)
    kept = recorded(plc)
    plc.run(scans=3)
    plc.breakpoints.line("Step")
    plc.run(scans=1)
    assert plc.halted
    plc.write("Main.Go", True)
    plc.breakpoints.clear()
    plc.run(scans=5)
    assert plc.read("Main.Steps.Count") == 4
    assert contents(kept.at(plc.scans)) == contents(plc)
    assert kept.at(2).read("Main.n") == 2


@pytest.mark.parametrize("again_ns", [module.AGAIN_NS, 0])
def test_forces_are_inputs(image: Image, again_ns: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where each scan has a keyframe of its own."""
    monkeypatch.setattr(module, "AGAIN_NS", again_ns)
    plc, seen = Plc(image), list[object]()
    kept = recorded(plc)
    for scan in range(8):
        if scan in (2, 4):
            plc.force("Main.Go" if scan == 2 else "D7", scan == 2 or 5)
        elif scan == 5:
            plc.force("TF7", True)
        elif scan == 6:
            plc.unforce()
        plc.scan()
        seen.append((plc.forces, plc.read("Main.Steps.Count"), plc.read("D7"), plc.read("TF7")))
    assert [(done.forces, done.read("Main.Steps.Count"), done.read("D7"), done.read("TF7"))
            for done in kept.again(range(8))] == seen
    assert [len(forces) for forces, *_ in seen] == [0, 0, 1, 1, 2, 3, 0, 0]  # type: ignore[misc]


def test_many_inputs_lead_to_a_keyframe(image: Image, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_INPUT_BYTES", 1000)
    plc = Plc(image)
    kept = recorded(plc)
    for value in range(40):
        plc.memory.u8[-100:] = bytes([value + 1]) * 100
        plc.scan()
    firsts = sorted({kept.chunk(scan).first for scan in kept.scans})
    assert firsts[0] == 0 and 3 <= len(firsts) <= 10
    assert [done.memory.u8[-1] for done in kept.again(range(28, 32))] == [29, 30, 31, 32]


# --- units ------------------------------------------------------------------------------------------------------------

def client(engine: str, timing: str = "exact") -> Plc:
    """A PLC that reads registers of a server in memory again and again."""
    image = compile_files([Path("tests/bench/poll.st")]).image
    assert image is not None
    plc, network = Plc(image, engine=engine), LoopNetwork(3, latency_ns=4_000_000)
    network.place(Peer("192.168.250.1", 502), ModbusPeer(server()))
    plc.attach(Etn21(0, "192.168.250.21", timing=timing, seed=5), network)
    return plc


@pytest.mark.slow
@pytest.mark.parametrize("timing", ["exact", "real"])
@pytest.mark.parametrize("engine", ENGINES)
def test_units_are_run_again_with_what_the_network_told_them(engine: str, timing: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "AGAIN_NS", 400_000)
    plc, twin, seen, again = client(engine, timing), client("python", timing), WatchedRun(), WatchedRun()
    kept = recorded(plc)
    plc.run(scans=70)
    assert not kept.wants_plain_scans and len(kept._chunks) > 3
    with observing(twin, seen):
        twin.run(scans=70)
    assert plc.read("Main.Exchanges") >= 3  # type: ignore[operator]
    kept.follow(again, kept.scans)
    assert again.rows == seen.rows
    for scan in (31, 50):
        assert contents(kept.at(scan)) == seen.rows[scan - 1][-1][1]


@pytest.mark.slow
def test_a_change_of_a_unit_is_an_input() -> None:
    plc = client("python")
    kept = recorded(plc)
    plc.run(scans=10)
    plc.units[0].unit.link_up = False  # type: ignore[attr-defined]
    plc.run(scans=10)
    assert (kept.at(10).read("CIO 1517"), kept.at(11).read("CIO 1517")) == (plc.read("CIO 1517") or 0x4000, 0)
    assert contents(kept.at(20)) == contents(plc)


@pytest.mark.slow
def test_of_units_that_cannot_go_on_from_a_state_the_refresh_is_recorded(image: Image) -> None:
    made = compile_text("""PROGRAM Main
        VAR n : UINT; Words AT %CIO1500 : ARRAY[0..7] OF WORD; Table AT %D20000 : WORD; END_VAR
        n := n + 1; IF NOT Words[0].0 THEN Table := UINT_TO_WORD(n); Words[0].0 := TRUE; END_IF; END_PROGRAM""").image
    assert made is not None
    plc, seen = Plc(made), []
    plc.attach(Toy(0, 7_000_000), Echoing(2_000_000))
    kept = recorded(plc)
    for _ in range(50):
        plc.scan()
        seen.append(contents(plc))
    assert kept.wants_plain_scans
    for scan in (1, 20, 49):
        assert contents(kept.at(scan + 1)) == seen[scan]
    assert len({memory[-4096:] for memory in seen}) >= 1 and plc.read("CIO 1502") != 0


def test_python_in_place_of_a_block_is_called_once_and_its_results_are_played_back(image: Image) -> None:
    plc, calls = Plc(image), []
    kept = recorded(plc)
    body = next(number for number, body in enumerate(image.bodies) if body.name == "Step")
    count = plc.find("Main.Steps.Count")

    def stub(base: int) -> None:
        calls.append(plc.scans)
        plc.memory.u8[count.offset] = 3 * len(calls)  # type: ignore[union-attr]

    kept.substitute(body, stub)
    plc.run(scans=20)
    assert kept.at(11).read("Main.Steps.Count") == 33
    assert calls == list(range(20))
    with pytest.raises(ValueError, match="before the first scan"):
        kept.substitute(body, stub)


# --- the ring ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_oldest_scans_give_way(image: Image, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "AGAIN_NS", 300_000)
    plc, other = Plc(image), Plc(image)
    recording = Recording(limit_bytes=200_000)
    one, two = recording.add("one", plc), recording.add("two", other)
    for _ in range(60):
        press(plc, 20)
        press(other, 20)
    assert recording.size_bytes < 210_000
    assert 0 < one.scans.start < 1200 and one.scans.stop == 1200
    assert abs(one.scans.start - two.scans.start) < 100
    assert contents(one.at(1200)) == contents(plc)
    with pytest.raises(ValueError, match="scan 0 is not recorded; recorded are"):
        one.at(0)


@pytest.mark.slow
def test_sizes_are_given_back(image: Image, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "AGAIN_NS", 300_000)
    plc, recording = Plc(image), Recording()
    kept = recording.add("plc", plc)
    press(plc, 400)
    assert recording.size_bytes == sum(kept._sizes) > 0
    while kept.may_shrink:
        recording._grown(-kept.shrink())
    assert (recording.size_bytes, kept._sizes, len(kept._chunks)) == (0, [], 1)


TIMES = {
    "in equal steps": ([(0, 1, 0), (10, 1, 0), (20, 5, 10), (70, 1, 0)], [0, 10, 20, 30, 40, 50, 60, 70], 1),
    "any": ([(0, 1, 0), (3, 1, 0), (4, 1, 0), (9, 1, 0)], [0, 3, 4, 9], 2),
    "another step": ([(5, 4, 2), (20, 3, 5), (31, 1, 0)], [5, 7, 9, 11, 20, 25, 30, 31], 3),
    "many behind one": ([(0, 1, 0), (10, 3, 10), (45, 2, 10), (65, 1, 0)], [0, 10, 20, 30, 45, 55, 65], 2),
    "many behind another": ([(0, 1, 0), (7, 3, 10)], [0, 7, 17, 27], 2),
}


@pytest.mark.parametrize("given", [*TIMES])
def test_times(given: str) -> None:
    rows, all_ns, runs = TIMES[given]
    times = Times(100)
    for row in rows:
        times.add(*row)
    assert times.end == 100 + len(all_ns)
    assert [times.at(100 + number) for number in range(len(all_ns))] == all_ns
    assert times.size_bytes == 24 * runs
    for scan in range(100, times.end):
        count, step_ns = times.regular(scan)
        assert all_ns[scan - 100 : scan - 100 + count] == [all_ns[scan - 100] + step_ns * n for n in range(count)]
    for end in range(times.end, 99, -1):
        times.cut(end)
        assert times.end == end
        assert [times.at(100 + number) for number in range(end - 100)] == all_ns[: end - 100]
    times.add(*rows[0])
    assert times.at(100) == all_ns[0]


def test_phases_of_a_mode_without_program(image: Image) -> None:
    plc, again = Plc(image), WatchedRun()
    plc.mode = Mode.PROGRAM
    kept = recorded(plc)
    plc.run(scans=3)
    kept.follow(again, kept.scans)
    assert [row[2][0] for row in again.rows] == [Phase.REFRESH.value] * 3
