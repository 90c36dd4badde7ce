"""Which options of `fbvm run` go together, and what a run says of each of its options behind it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, ClassVar, cast

import click
import pytest
from images import counter_image
from rows import each_of

from fbvm.cli.running import run
from fbvm.cli.shared.options import Door, Mapping, Setting
from fbvm.cli.shared.run_recording import RunRecording
from fbvm.machine.plc import Plc
from fbvm.run.plant import ENDLESS
from fbvm.wire.link import Peer

MS = 1_000_000
UNIT = Peer("10.0.0.1", 502)
NOTHING: dict[str, Any] = {
    "live": False, "net": "loop", "doors": (), "pace": "cyclic", "debug_port": None, "scan_time": False, "as_json": False,
    **dict.fromkeys(("lines", "watched", "conditions", "charted", "shown"), ()),
    **dict.fromkeys(("scans", "for_ns", "until", "max_ns", "pcap", "journal", "trace", "html", "rungs", "charts"))}  # fmt: skip
ENDS = "say when to end by one of --scans, --for and --until; {} given (such as --for 1s)"


@each_of("options, said", [
    ({}, ENDS.format("none")), ({"scans": 0}, ""), ({"for_ns": 1}, ""), ({"until": "a"}, ""), ({"until": ""}, ""),
    ({"scans": 0, "for_ns": 1}, ENDS.format(2)), ({"scans": 1, "for_ns": 1, "until": "a"}, ENDS.format(3)),
    ({"for_ns": 1, "until": "a", "doors": ("door",)}, ENDS.format(2)), ({"doors": ("door",), "net": "tcp"}, ""),
    ({"live": True}, ""), ({"debug_port": 0}, ""), ({"debug_port": 0, "scans": 1, "for_ns": 1}, ENDS.format(2)),
    ({"max_ns": 1, "for_ns": 1}, "--max bounds --until, which is not given"), ({"max_ns": 1, "until": "a"}, ""),
    ({"max_ns": 0, "for_ns": 1}, "--max bounds --until, which is not given"),
    ({"pace": "event", "scans": 1}, "--pace event is for real time: add --net tcp"),
    ({"pace": "event", "scans": 1, "net": "tcp"}, ""),
    ({"live": True, "debug_port": 0}, "--live shows it on the page: leave out --debug"),
    # what a page shows itself, and what looks into scans itself
    ({"live": True, "html": "a", "shown": ("n",)}, "--live shows it on the page: leave out --html, --show"),
    ({"live": True, "rungs": "1", "charts": "2", "charted": ("n",), "pcap": "f", "debug_port": 5, "scan_time": True},
     "--live shows it on the page: leave out --ladder, --sfc, --chart, --pcap, --debug, --scan-time"),
    ({"live": True, "as_json": True}, "--live shows it on the page: leave out --json"),
    ({"debug_port": 0, "as_json": True}, ""), ({"live": True, "trace": "a", "lines": ("3",)}, ""),
    ({"debug_port": 5, "trace": "a", "lines": ("3",)}, "--debug looks into scans itself: leave out --trace, --break"),
    ({"debug_port": 0, "journal": "a", "html": "a", "rungs": "1", "charts": "1", "charted": ("n",), "watched": ("n",),
      "conditions": ("n",)}, "--debug looks into scans itself: leave out --journal, --html, --ladder, --sfc, --chart, --watch, "
                             "--break-if"),
    ({"debug_port": 0, "shown": ("n",), "pcap": "f", "scan_time": True}, ""), ({"scans": 1, "html": "a", "shown": ("n",)}, ""),
])
def test_bounds_and_options_that_go_together(options: dict[str, Any], said: str) -> None:
    refused = ""
    try:
        run._check_usage(**NOTHING | options)
    except click.UsageError as error:
        refused = error.message
    assert refused == said


def door(port: int, endpoint: Peer | None = None) -> Door:
    return Door(endpoint, None, port)


HERE, THERE = Mapping(UNIT, None, 0), Mapping(UNIT, "h", 6)


@each_of("net, mappings, doors, bind, said", [
    ("loop", [], [], "127.0.0.1", ""), ("loop", [HERE], [], "127.0.0.1", ""), ("tcp", [THERE], [door(5)], "10.0.0.9", ""),
    ("loop", [], [], "10.0.0.9", "--bind leaves memory: add --net tcp"),
    ("loop", [], [door(5)], "127.0.0.1", "--door leaves memory: add --net tcp"),
    ("loop", [], [door(5)], "10.0.0.9", "--door leaves memory: add --net tcp"),
    ("tcp", [], [], "nowhere", "--bind nowhere is not an IPv4 address of this computer"),
    ("loop", [HERE, HERE], [], "127.0.0.1", "10.0.0.1:502 is mapped twice"),
    ("tcp", [THERE], [door(5, UNIT)], "127.0.0.1", "10.0.0.1:502 is mapped twice"),
    ("tcp", [], [door(5, UNIT), door(6, UNIT)], "127.0.0.1", "10.0.0.1:502 is mapped twice"),
    ("tcp", [], [door(5, UNIT), door(6, Peer("10.0.0.1", 503)), door(7)], "127.0.0.1", ""),
    ("tcp", [], [door(5), door(6)], "127.0.0.1", "several doors: say of each which it is, --door IP:PORT=HOST:PORT"),
    ("loop", [THERE], [], "127.0.0.1", "--map 10.0.0.1:502=h:6 leaves memory: add --net tcp"),
    ("tcp", [HERE], [], "127.0.0.1", "--map 10.0.0.1:502=peer is in memory: leave out --net tcp, or use `fbvm peer`"),
])
def test_endpoints_that_go_together(net: str, mappings: list[Mapping], doors: list[Door], bind: str, said: str) -> None:
    refused = ""
    try:
        run._check_endpoints(net=net, mappings=tuple(mappings), doors=tuple(doors), bind=bind, pace="cycle")
    except click.UsageError as error:
        refused = error.message
    assert refused == said


OPTIONS: dict[str, Any] = {"pace": "cyclic", **dict.fromkeys(("scans", "for_ns", "until", "max_ns")), **dict.fromkeys(
    ("settings", "shown", "charted", "lines", "watched", "conditions"), ())}  # fmt: skip


def prepared(**options: Any) -> Any:
    return run._prepared(Plc(counter_image()), **OPTIONS | options)


def test_a_run_is_prepared_before_it_begins() -> None:
    made = prepared(settings=(Setting("D5", "7", 20 * MS, "20ms"),), shown=("D5", "Main.n"), scans=3)
    assert (list(made.shown), made.recorder, made.running.scans_left) == (["D5", "Main.n"], None, 3)
    assert [(write.value, write.at_ns) for write in made.writes] == [(7, 20 * MS)] == [
        (write.value, write.at_ns) for write in made.running.writes]
    assert prepared(for_ns=1).running.scans_left == ENDLESS and prepared(scans=0).running.scans_left == 0
    assert prepared(charted=("D5",)).recorder is not None


@each_of("options, said", [
    ({"shown": ("Nobody",)}, "there is no Nobody"), ({"settings": (Setting("D5", "70000", 0),)}, "D5: 70000 is out of range"),
    ({"until": "D5 >"}, "'D5 >' ends too early"), ({"lines": ("nowhere",)}, "'nowhere'"),
    ({"charted": ("Nobody",)}, "there is no Nobody")])
def test_what_does_not_fit_the_program_is_told_in_the_beginning(options: dict[str, Any], said: str) -> None:
    with pytest.raises(click.UsageError) as error:
        prepared(**options)
    assert said in error.value.message


class Shown:
    """Stands in for the progress of a run: what it was made of, and how often it was told."""

    made: ClassVar[list[Any]] = []

    def __init__(self, *given: Any) -> None:
        self.made.append(given)

    def __enter__(self) -> Shown:
        return self

    def __exit__(self, *raised: object) -> None:
        self.made.append("over")

    def update(self, plc: Plc) -> None:
        self.made.append("update")


@each_of("scans, at_ms, told", [(3, 0, False), (3, 20, False), (3, 21, True), (0, 0, True), (0, 20, True)])
def test_a_write_that_came_too_late_is_told(scans: int, at_ms: int, told: bool, capsys: pytest.CaptureFixture[str]) -> None:
    setting = Setting("D5", "7", at_ms * MS, f"{at_ms}ms")
    made = prepared(settings=(setting,), scans=scans)
    ticks: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        Shown.made = []
        patch.setattr(run, "RunProgress", Shown)

        def execute(running: Any, port: Any, files: Any, libraries: Any, progress: Any) -> None:
            assert (port, files, libraries) == (None, ("files",), ("libraries",))
            running.plc.run(scans=scans) if scans else None
            progress()

        patch.setattr(run, "_execute", execute)
        recorded = cast(RunRecording, SimpleNamespace(tick=lambda: ticks.append("tick")))
        capture: Any = SimpleNamespace(flush=lambda: ticks.append("flush"))
        result = run._run(made, bool(scans), capture, recorded, settings=(setting,), scans=scans, for_ns=None, until="D5 = 1",
                          max_ns=9, net="loop", scan_time=False, debug_port=None, files=("files",), libraries=("libraries",))  # type: ignore[arg-type]
    assert ticks == ["tick", "flush"] and Shown.made[0] == (None if scans else made.running.plc, scans, 9)
    assert Shown.made[1:] == ["update", "over"]
    assert capsys.readouterr().err == (f"--set D5=7@{at_ms}ms was never written: the run ended before\n" if told and at_ms
                                       else "--set D5=7@0ms was never written: the run ended before\n" if told else "")
    assert (result.plc, result.until, result.as_json) == (made.running.plc, "D5 = 1", bool(scans))
