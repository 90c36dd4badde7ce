"""What stands beside the loop: names of several PLCs, slices of work, limits of time, the pace of a debugger, readers of keys."""

from __future__ import annotations

from typing import Any

import pytest
from images import counter_image
from rows import each_of
from test_run_loop import MS, Clock, RealNetwork, real_plc

from fbvm.machine.plc import Plc
from fbvm.net.faults import NAMED
from fbvm.run import fault_rows, real_pace, slices, time_limit
from fbvm.run import project_reader as reader
from fbvm.run.fault_rows import FAULT
from fbvm.run.plc_names import PlcNames
from fbvm.run.real_pace import RealPace
from fbvm.run.running import Running, TimedWrite
from fbvm.run.slices import SLICE_NS, TOLD_NS, Slices
from fbvm.watch.paths import UnknownPlace
from fbvm.wire.link import Peer


def names(alone: bool, *plcs: str) -> tuple[PlcNames, dict[str, Plc]]:
    made = {name: Plc(counter_image()) for name in plcs}
    return PlcNames({name: (plc.find, lambda place, plc=plc: lambda: plc.read(place)) for name, plc in made.items()}, alone), made


def test_a_name_begins_with_its_plc() -> None:
    found, plcs = names(False, "pump", "valve")
    plcs["valve"].write("D5", 7)
    place = found.find("valve.D5")
    assert (place.name, found.read(place), found.owner(place)) == ("valve.D5", 7, ("valve", plcs["valve"].find("D5")))
    assert found.read(found.find("pump.D5")) == 0
    plcs["valve"].write("D5", 8)
    assert found.read(place) == 8
    for wrong, said in (("D5", "begins with the name of no PLC; there is pump, valve"), ("pump.D5..D6", "is a range; name one"),
                        ("pump.Nothing", "Nothing")):  # fmt: skip
        with pytest.raises(UnknownPlace, match=said):
            found.find(wrong)


def test_the_name_of_an_only_plc_may_be_left_out_where_that_is_said() -> None:
    found, _ = names(True, "pump")
    assert found.parted("D5") == ("pump", "D5") and found.parted("pump.D5") == ("pump", "D5")
    for found in (names(False, "pump")[0], names(True, "pump", "valve")[0]):
        with pytest.raises(UnknownPlace):
            found.parted("D5")


def test_work_is_done_in_slices_and_told_of_every_half_second(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock()
    monkeypatch.setattr(slices, "time", clock)
    told: list[int] = []
    left = [300]

    def work() -> bool:
        clock.now_ns += 5 * MS
        left[0] -= 1
        return left[0] > 0

    sliced = Slices(work, lambda: told.append(left[0]))
    clock.now_ns += TOLD_NS
    sliced.begin()
    sliced.slice()
    assert left == [300 - SLICE_NS // (5 * MS)] and not told
    while left[0] > 0:
        sliced.slice()
    assert told == [200, 100, 0]
    sliced.slice()
    assert left[0] == -1, "work that has nothing left is asked once a slice"


def test_limits_of_time(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock()
    monkeypatch.setattr(time_limit, "time", clock)
    is_over, passed = time_limit.time_limit(10 * MS), time_limit.stopwatch()
    clock.now_ns += 9 * MS
    assert not is_over() and 9 * MS <= passed() < 10 * MS
    time_limit.pause(2 * MS)
    assert is_over() and 11 * MS <= passed() < 12 * MS and clock.slept_ns == [2 * MS]


def test_under_a_debugger_real_time_stands_while_no_scan_is_executed(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock()
    monkeypatch.setattr(real_pace, "time", clock)
    plc, network = real_plc(clock)
    served: list[int] = []
    monkeypatch.setattr(RealNetwork, "serve", lambda self, now_ns: served.append(now_ns) or [])
    virtual = Plc(counter_image())
    virtual.run(scans=5)
    pace = RealPace([plc, virtual])
    assert pace.is_real and not RealPace([virtual]).is_real
    assert 60 * MS <= pace.wait(60 * MS) < 61 * MS, "time goes on where the latest of the PLCs stood: at 50 ms"
    assert [round(slept_ns / MS) for slept_ns in clock.slept_ns] == [10]
    clock.now_ns += 7 * MS
    assert 67 * MS <= pace.wait(60 * MS) < 68 * MS and len(clock.slept_ns) == 1, "a scan that is late has the time that it is"
    clock.now_ns += 1000 * MS
    pace.begin()
    assert 55 * MS <= pace.wait(55 * MS) < 56 * MS and len(served) == 3
    assert network.driven is False


WEEK = reader.time_between(10 * MS, 1000 * MS, "from 10 ms to 1 s")
RANGE, TIMES = reader.first_and_last(reader.whole(1, 9)), reader.one_or_more(reader.time_ns)


@each_of(("kind", "written", "value"), [
    (reader.text, "a", "a"), (reader.texts, ["a", "b"], ("a", "b")), (reader.texts_by_name, {"TRUE": "red"}, {"TRUE": "red"}),
    (reader.flag, False, False), (reader.time_ns, "1ms", MS), (reader.moment_ns, "0s", 0), (reader.ip, "0.0.0.255", "0.0.0.255"),
    (reader.endpoint, "1.2.3.4:65535", Peer("1.2.3.4", 65535)), (reader.host, "localhost:0", ("localhost", 0)),
    (RANGE, 3, (3, 3)),
    (reader.host, "::1:5", ("::1", 5)), (reader.whole(-1, 3), -1, -1), (reader.whole(-1, 3), 3, 3), (WEEK, "10ms", 10 * MS),
    (WEEK, "1s", 1000 * MS), (RANGE, [1, 9], (1, 9)), (RANGE, [2, 2], (2, 2)), (TIMES, "1ms", (MS,)),
    (TIMES, ["2ms", "1ms"], (2 * MS, MS)),
    (reader.one_of(("a", "b")), "b", "b"), (reader.anything, [1], [1]),
])  # fmt: skip
def test_what_is_written_for_a_key(kind: reader.Kind, written: object, value: object) -> None:
    assert kind.value(written) == value


@each_of(("kind", "written", "said"), [
    (reader.text, "", "no text"), (reader.text, 5, "no text"), (reader.texts, [], "no list"),
    (reader.texts, ["a", ""], "no list"),
    (reader.texts, "a", "no list"), (reader.texts, ["a", 1], "no list"), (reader.texts_by_name, {}, "no table"),
    (reader.texts_by_name, {"a": ""}, "no table"), (reader.texts_by_name, ["a"], "no table"),
    (reader.texts_by_name, {"a": 1}, "no table"),
    (reader.flag, 1, "neither true nor false"), (reader.time_ns, "0s", "no time that can pass"),
    (reader.time_ns, 5, "no time; write it"),
    (reader.moment_ns, "-1ms", "before power-on"), (reader.ip, "1.2.3.256", "no IPv4"), (reader.ip, "1.2.3", "no IPv4"),
    (reader.ip, "1.2.3.x", "no IPv4"), (reader.ip, 5, "no IPv4"), (reader.endpoint, "1.2.3.4:65536", "no address and port"),
    (reader.endpoint, ":502", "no address and port"), (reader.host, "localhost", "no address and port; write"),
    (WEEK, "9ms", "no time from"),
    (reader.host, "localhost:x", "no address"), (reader.whole(-1, 3), -2, "no whole number from -1 to 3"),
    (reader.whole(-1, 3), 4, "no whole"),
    (reader.whole(-1, 3), True, "no whole number"), (reader.whole(-1, 3), 1.0, "no whole number"),
    (WEEK, "1001ms", "no time from 10 ms"),
    (RANGE, [2, 1], "no range; write"), (RANGE, [1], "no range"), (RANGE, [1, 2, 3], "no range"),
    (RANGE, [1, 10], "no whole number"),
    (TIMES, [], "says nothing"), (TIMES, ["0s"], "no time"), (reader.one_of(("a", "b")), "c", "'c' is none of a, b"),
])  # fmt: skip
def test_what_is_no_value_of_a_key(kind: reader.Kind, written: Any, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        kind.value(written)


def test_what_kinds_are_called() -> None:
    kinds = (reader.whole(1, 3), reader.whole(0, 1 << 62), reader.one_of(("a", "b")), RANGE, TIMES, WEEK)
    assert [kind.called for kind in kinds] == [
        "a whole number from 1 to 3", "a whole number from 0", '"a" or "b"',
        "a whole number from 1 to 9, or a list of two, the first and the last",
        'a time above 0, such as "10ms", or a list of such',
        "a time from 10 ms to 1 s"]  # fmt: skip


def test_what_somebody_else_has_written_is_not_written_again() -> None:
    """As a run that a debugger has carried on: what was due up to the last scan is done, and the goal may be reached."""
    plc = Plc(counter_image())
    rows = [TimedWrite(plc.find("D5"), value, at_ns) for value, at_ns in ((1, 0), (2, 10_000_000), (3, 10_000_001))]
    run = Running(plc, writes=rows, scans=2)
    run.resume()
    assert ([row.value for row in run.writes], run.reason) == ([1, 2, 3], "")
    plc.run(scans=2)
    run.resume()
    assert plc.now_ns == 10_000_000 and ([row.value for row in run.writes], run.reason) == ([3], "scans")


def test_the_page_of_faults_says_of_each_kind_what_it_sets() -> None:
    lines = fault_rows.page().split("\n")
    assert lines[:12] == [
        "# Faults of a network", "",
        "A row of fbvm.toml, [[fault]], says what befalls connections with an endpoint, in memory as with real connections",
        '(net = "tcp"), of peers as of doors. The first row that fits and is in force counts.', "", "    [[fault]]",
        '    kind = "slow"', '    latency = "80ms"', '    peer = "192.168.250.1:502"', '    from = "2s"', "", "## Kinds"]
    first = lines.index("## Kinds") + 2
    assert lines[first : first + 8] == [
        "slow         data take longer each way; needs latency", "             latency = ...",
        "unsteady     data take longer by chance; needs jitter", "             jitter = ...",
        "cut          data arrive in pieces of 1 byte up to a size", "             segment_bytes = 5, random_cut = true",
        "dripping     data arrive byte by byte", '             segment_bytes = 1, gap = "12ms"']
    keys = lines.index("## Keys")
    assert keys == first + 2 * len(NAMED) + 1 and lines[keys - 1] == lines[keys + 1] == ""
    assert [line[:18].strip() for line in lines[keys + 2 : keys + 2 + len(FAULT)]] == list(FAULT)
    assert lines[keys + 3] == "peer               Only connections with this endpoint; 0.0.0.0 and port 0 fit any."
    assert lines[keys + 2 + len(FAULT) :] == [
        "", "From Python: network.faults is a list of rows, which may be changed while PLCs run.", "",
        "    from fbvm.net.faults import fault", '    plant.network.faults.append(fault("slow", latency_ns=80_000_000))']
