"""What one page sees and asks for.  It reads no clock and no socket: texts of messages in, texts out."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable
from typing import Any

from fbvm.base.areas import FLAG_AREAS
from fbvm.live.futures import REPEATED, order_of
from fbvm.live.lesson import LiveLesson
from fbvm.live.messages import ACTIONS, MOST_NAMES, VERSION, MessageError, dump, message_id, parse
from fbvm.live.plcs import LivePlc
from fbvm.live.program import ScanView, source_of
from fbvm.live.stops import halt_row, shown_breakpoints
from fbvm.live.symbols import parts, row, search
from fbvm.live.workbench import REFUSED, Workbench, fault_rows
from fbvm.machine.plc import Plc
from fbvm.machine.state import Mode
from fbvm.net.faults import NAMED
from fbvm.record.draw.why import cause_text, why
from fbvm.record.recording.scans import RecordedScans
from fbvm.watch.names import is_single
from fbvm.watch.paths import Place, Span
from fbvm.watch.values import Value, show

UPDATE_NS = 100_000_000
"""The shortest time between two updates of a page."""
VIEW_NS = 250_000_000
"""The shortest time between two scans that are observed for a page: where Python alone observes, it is much slower."""
MOST_SHOWN = 300
"""Characters of a value; what is longer is cut."""
MEMORY_WORDS = 200
"""Words that the memory panel shows at once."""
MOST_HISTORY, WHY_SCANS = 500, 300
"""Scans that are executed again for a trend, and for the cause of a value."""
ACTS = 100


class Session:
    """A page's session at a workbench.  `answer` takes a message and returns the reply; `update` is what has changed."""

    def __init__(self, workbench: Workbench) -> None:
        self._bench = workbench
        self._live: LivePlc = next(iter(workbench.plcs.values()))
        self._names: dict[str, Place | Span] = {}
        self._instance = ""
        self._memory: tuple[str, int] | None = None
        self._units = self._network = self._pictures = self._times = False
        self._past: tuple[int, Plc] | None = None
        self._past_view: ScanView | None = None
        self._other: LivePlc | None = None
        """The PLC in another future, if that is looked at."""
        self._ready = False
        self._told_ns = self._viewed_ns = -VIEW_NS
        self._begins = False
        """True if the next update says that the page has to begin again."""
        self._known: dict[str, Any] = {}
        """What the page knows: values by name, other parts by theirs."""
        self._frames = self._acts = 0
        self._actions: dict[str, Callable[..., Any]] = {
            "hello": self._hello, "ready": self._take, "look": self._look, "program": self._program, "source": self._source,
            "search": self._search, "parts": self._parts, "history": self._history, "why": self._why, "test": self._test,
            "capture": self._capture, "view": self._view, "branch": self._branch, "write": self._write,
            "force": workbench.force, "release": workbench.release, "run": self._run, "pause": workbench.pause,
            "step": self._step, "statement": self._statement, "break": workbench.set_breakpoint,
            "unbreak": workbench.remove_breakpoint, "speed": workbench.speed, "mode": workbench.set_mode,
            "start": workbench.start, "cable": workbench.cable, "fault": workbench.add_fault, "mend": workbench.mend,
            "restart": workbench.restart, "predict": self._predict, "check": self._check, "solution": self._solution,
        }  # fmt: skip

    # --- messages -----------------------------------------------------------------------------------------------------

    def answer(self, text: str) -> str:
        """The reply to a message; a message that cannot be understood or done gets an error, and raises nothing."""
        number: Any = None
        try:
            message = parse(text)
            number = message.pop("id", None)
            if not (number is None or type(number) is int):
                number = None
                raise MessageError("an id is a whole number")
            action = message.pop("do")
            if ACTIONS[action].changes and self._bench.read_only:
                raise MessageError("this page may only look: fbvm runs with --read-only")
            if ACTIONS[action].changes and self._bench.held_by:
                raise MessageError(f"{self._bench.held_by} has the PLC: this page looks on meanwhile")
            if self._past and action in ("write", "force", "release"):
                raise MessageError(f"this is scan {self._past[0]}, which is past: go back to now, or on from here, first")
            fields = {name: value for name, value in message.items() if value is not None}
            order = order_of(self._bench, action, fields)
            done = self._actions[action](**fields)
            if action in REPEATED:
                self._bench.orders.append(order)
        except MessageError as error:
            return dump({"re": number if number is not None else message_id(text), "error": str(error)})
        except REFUSED as error:
            return dump({"re": number, "error": str(error)})
        return dump({"re": number, "ok": done if done is not None else {}})

    def begin_again(self) -> None:
        """Tells the page, which was in the session before this one, that other PLCs run now: it says hello once more."""
        self._begins = self._ready = True

    def end(self) -> None:
        """The page has gone."""
        self._ready, self._past, self._other = False, None, None

    def _hello(self, version: int = VERSION) -> dict[str, Any]:
        if version != VERSION:
            raise MessageError(f"this fbvm speaks version {VERSION} of its messages, not {version}")
        self._known, self._frames, self._acts = {}, 0, 0
        self._ready = True
        bench = self._bench
        return {
            "version": VERSION, "read_only": bench.read_only, "writable": bench.writable,
            "real": any(live.is_real for live in bench.plcs.values()), "tests": bench.make_test is not None,
            "branches": bench.can_branch, "futures": [future.name for future in bench.futures],
            "lesson": bench.lesson.about() if bench.lesson else None,
            "pictures": bench.pictures is not None and bool(bench.pictures.shown),
            "modes": [mode.value for mode in Mode], "faults": {name: kind.meaning for name, kind in NAMED.items()},
            "plcs": [{"name": live.name, "cycle": live.plc.cycle_ns, "instances": live.instances,
                      "areas": {name: area.size_bytes // 2 for name, area in live.plc.memory.areas.items()
                                if area.unit_bits == 16 and name not in FLAG_AREAS},
                      "units": [attached.unit.name for attached in live.plc.units]} for live in bench.plcs.values()],
        }  # fmt: skip

    def _take(self) -> None:
        """The page has shown the last update."""
        self._ready = True

    def _look(self, plc: str, names: list[str] | None = None, instance: str | None = None, memory: str | None = None,
              first: int = 0, units: bool = False, network: bool = False, scan: bool = False,
              pictures: bool = False, times: bool = False) -> dict[str, Any]:  # fmt: skip
        """From now on the page sees these names and panels, and nothing else; `scan` wants to see inside scans."""
        live = self._bench.plc(plc)
        found: dict[str, Place | Span] = {}
        unknown: dict[str, str] = {}
        for name in (names or [])[:MOST_NAMES]:
            try:
                found[name] = live.plc.find(name)
            except REFUSED as error:
                unknown[name] = str(error)
        if memory is not None and memory not in live.plc.memory.areas:
            raise MessageError(f"this PLC has no area {memory[:10]!r}")
        if live is not self._live:
            self._past = self._past_view = self._other = None
            self._frames = 0
        self._live, self._names, self._instance = live, found, (instance or "") if scan else ""
        self._memory = (memory, max(0, first)) if memory else None
        self._units, self._network, self._pictures, self._times = units, network, pictures, times
        self._known, self._viewed_ns = {}, -VIEW_NS
        if not network:
            self._frames = 0
        if self._instance and live.view is None:
            live.wish_view(self._bench.control.is_paused)
        return {"unknown": unknown, "rows": {name: row(place, live.described) for name, place in found.items()}}

    # --- questions ----------------------------------------------------------------------------------------------------

    def _program(self, plc: str) -> dict[str, Any]:
        return {"instances": self._bench.plc(plc).instances}

    def _source(self, plc: str, instance: str) -> dict[str, Any]:
        live = self._bench.plc(plc)
        return source_of(live.plc.image, live.plc.memory.areas, live.texts, instance)

    def _search(self, plc: str, text: str) -> dict[str, Any]:
        live = self._bench.plc(plc)
        return {"found": search(live.plc, live.described, text)}

    def _parts(self, plc: str, name: str) -> dict[str, Any]:
        live = self._bench.plc(plc)
        return {"parts": parts(live.plc, live.described, name)}

    def _history(self, plc: str, names: list[str], scans: int) -> dict[str, Any]:
        """The values of some names in the last recorded scans, or the last before the one that is looked at."""
        live = self._quiet(plc)
        held = live.recorded.scans
        stop = self._past[0] + 1 if self._past else held.stop
        wanted = range(max(held.start, stop - min(max(1, scans), MOST_HISTORY)), stop)
        places = [place for name in names[:50] if isinstance(place := live.plc.find(name), Place) and is_single(place)]
        rows: list[list[str]] = [[] for _ in places]
        times: list[int] = []
        for moment in live.past.moments(wanted):
            times.append(moment.now_ns)
            for made, place in zip(rows, places, strict=True):
                made.append(_shown(place, live.names.read(moment.read, place)))
        values = {place.name: made for place, made in zip(places, rows, strict=True)}
        return {"first": wanted.start, "times": times, "values": values}

    def _why(self, plc: str, name: str) -> dict[str, Any]:
        """The statement that gave a value, and what led to it, as lines of text."""
        live = self._quiet(plc)
        place = live.plc.find(name)
        if not isinstance(place, Place) or not is_single(place):
            raise MessageError(f"{place.name} is no single value; ask for one of its parts")
        held = live.recorded.scans
        if not held:
            raise MessageError("no scan has been recorded yet")
        scan = self._past[0] if self._past else held.stop - 1
        trace = RecordedScans(live.recorded, live.past.lines, first=max(held.start, scan - WHY_SCANS))
        return {"text": cause_text(trace, why(trace, place, scan))}

    def _test(self, plc: str) -> dict[str, Any]:
        """The acts so far as a pytest, with the values that the page sees now."""
        live = self._bench.plc(plc)
        if self._bench.make_test is None:
            raise MessageError("a test repeats runs of files in virtual time; others are repeated by `fbvm replay`: --trace FILE")
        seen = [name for name, place in self._names.items() if isinstance(place, Place) and is_single(place)]
        return {"text": self._bench.make_test([act for act in self._bench.acts if act.plc == plc], live, seen)}

    def _quiet(self, plc: str) -> LivePlc:
        """A PLC whose past may be executed again now: with real connections that must not take time from its scans."""
        live = self._bench.plc(plc)
        if live.is_real and not self._bench.control.is_paused:
            raise MessageError("pause first: while real connections are served no scan is executed again")
        return live

    # --- a lesson -----------------------------------------------------------------------------------------------------

    @property
    def _lesson(self) -> LiveLesson:
        if self._bench.lesson is None:
            raise MessageError("this page has no lesson: fbvm learn --live has one")
        return self._bench.lesson

    def _predict(self, names: list[str], values: list[str]) -> dict[str, Any]:
        return self._lesson.take_prediction(names, values)

    def _check(self) -> dict[str, Any]:
        return self._lesson.take_check()

    def _solution(self) -> dict[str, Any]:
        return {"text": self._lesson.solution()}

    # --- the scan -----------------------------------------------------------------------------------------------------

    def _branch(self, plc: str) -> None:
        """Goes on from the scan that is looked at, as if nothing had come behind it."""
        if self._past is None or self._other is not None:
            raise MessageError("look at a scan of the present run first: another future begins behind it")
        self._bench.branch(plc, self._past[0] + 1)

    def _capture(self, plc: str) -> dict[str, Any]:
        """What has passed the network last, as a file for Wireshark."""
        return {"pcapng": b64encode(self._bench.plc(plc).capture()).decode()}

    def _view(self, plc: str, scan: int | None = None, future: int | None = None) -> dict[str, Any]:
        """Looks at the end of a recorded scan, also of another future, or, without one, at the present again."""
        if scan is None:
            self._past = self._past_view = self._other = None
            self._known = {}
            return {}
        live = self._quiet(plc)
        other = None
        if future is not None:
            if not 0 <= future < len(self._bench.futures):
                raise MessageError(f"there is no future {future}")
            other = self._bench.futures[future].plcs.get(plc)
        seen = other or live
        held = seen.recorded.scans
        if scan not in held:
            raise MessageError(f"scan {scan} is not recorded; recorded are {held.start} to {held.stop - 1}" if held
                               else "no scan has been recorded yet")  # fmt: skip
        self._live, self._known, self._other = live, {}, other
        self._past = scan, seen.recorded.at(scan + 1)
        self._past_view = seen.past_view(scan) if self._instance else None
        return {"scan": scan}

    def _write(self, plc: str, name: str, value: str) -> dict[str, Any]:
        return {"value": self._bench.write(plc, name, value)}

    def _run(self) -> None:
        self._past = self._past_view = self._other = None
        self._bench.go_on()

    def _statement(self, plc: str) -> None:
        self._past = self._past_view = self._other = None
        self._bench.step_statement(plc)

    def _step(self, scans: int) -> None:
        self._past = self._past_view = self._other = None
        self._bench.step(scans)
        if self._instance:
            self._live.wish_view(True)

    # --- updates ------------------------------------------------------------------------------------------------------

    def update(self, now_ns: int) -> str | None:
        """What has changed for the page since the last update; None if nothing has, if the page has not taken the last one, or
        if that is less than 100 ms ago.  `now_ns` is the host's time."""
        if not self._ready or now_ns - self._told_ns < UPDATE_NS:
            return None
        if self._begins:
            self._begins = False
            return dump({"update": {"restarted": True}})
        changed = {**self._state(), **self._panels(now_ns)}
        changed = {name: value for name, value in changed.items() if self._is_new(name, value)}
        values = {name: text for name, place in self._names.items()
                  if self._is_new(f"={name}", text := self._text(place))}  # fmt: skip
        if values:
            changed["values"] = values
        if not changed:
            return None
        self._told_ns, self._ready = now_ns, False
        return dump({"update": changed})

    def _is_new(self, name: str, value: Any) -> bool:
        if name in self._known and self._known[name] == value:
            return False
        self._known[name] = value
        return True

    def _text(self, place: Place | Span) -> str:
        plc, names = self._seen, self._live.names
        if isinstance(place, Span):
            return f"[{', '.join(_shown(one, plc.read(one)) for one in place.places[:64])}]"[:MOST_SHOWN]
        return _shown(place, names.read(plc.read, place))

    @property
    def _seen(self) -> Plc:
        """The PLC that the page sees: as it is, or as it was."""
        return self._past[1] if self._past else self._live.plc

    def _state(self) -> dict[str, Any]:
        live, control = self._live, self._bench.control
        plc, held = live.plc, (self._other or live).recorded.scans
        state = "past" if self._past else "trap" if plc.trap else "halt" if plc.halted else "ended" if live.ended() else \
            "pause" if control.is_paused and not control.steps else "run"
        trap = plc.trap.told(live.names.instance) if plc.trap else ""
        return {
            "plc": live.name, "state": state, "mode": plc.mode.value, "speed": control.speed, "trap": trap,
            "scan": self._past[0] if self._past else plc.scans - 1, "ns": self._past[1].now_ns if self._past else plc.now_ns,
            "halt": halt_row(live, plc.halted) if plc.halted and not self._past else None,
            "breaks": [f"{row.kind} {row}" + (f" at passes {row.hits}" if row.hits else "") for row in shown_breakpoints(live)],
            "held": [held.start, held.stop - 1], "taken": str(plc.scan_times),
            "forces": {name: _plain(live, name, value) for name, value in self._seen.forces.items()},
        }  # fmt: skip

    def _panels(self, now_ns: int) -> dict[str, Any]:
        """What the open panels show."""
        live, bench, made = self._live, self._bench, dict[str, Any]()
        if self._instance:
            view = self._past_view if self._past else live.view
            if view is not None:
                made["inside"] = view.of(self._instance)
            if not self._past and now_ns - self._viewed_ns >= VIEW_NS:
                self._viewed_ns = now_ns
                live.wish_view(bench.control.is_paused)
        if self._memory:
            area, first = self._memory
            words = self._seen.memory.words(area)
            made["memory"] = {"area": area, "first": first, "words": list(words[first : first + MEMORY_WORDS])}
        if self._units:
            made["units"] = [self._unit(attached) for attached in live.plc.units]
        if self._network:
            rows = live.frame_rows(self._frames, None)
            if rows:
                made["frames"], self._frames = rows, rows[-1]["number"] + 1
            made["faults"] = fault_rows(bench.faults)
        if self._pictures and bench.pictures:
            made["pictures"] = bench.pictures.shown
            made["picture"] = dict(bench.pictures.values(live if self._past else None, lambda place: self._seen.read(place)))
        if self._times:
            made["times"] = live.plc.scan_times.bins
        if bench.changes:
            made["change"] = bench.changes.state
        acts = bench.acts[self._acts :][-ACTS:]
        if acts:
            made["acts"] = [[act.plc, act.scan, act.text] for act in acts if act.what != "keep"]
            self._acts = len(bench.acts)
        return made

    def _unit(self, attached: Any) -> dict[str, Any]:
        """A unit as the panel shows it: its words and bits that are not 0, with what they are called and what they mean."""
        unit, live, plc = attached.unit, self._live, self._seen
        rows = []
        for address, said in getattr(unit, "descriptions", {}).items():
            place = plc.find(address)
            value = plc.read(place)
            if isinstance(place, Place):
                meaning = live.meanings.get(address, {}).get(value, "") if isinstance(value, int) else ""
                rows.append([address, said, _shown(place, value), meaning])
        return {"name": unit.name, "address": unit.address, "plugged": self._bench.is_plugged(attached), "words": rows}


def _shown(place: Place, value: Value) -> str:
    text = show(place.type, value, place.hexadecimal)
    return text if len(text) <= MOST_SHOWN else f"{text[: MOST_SHOWN - 1]}…"


def _plain(live: LivePlc, name: str, value: Value) -> str:
    place = live.plc.find(name)
    assert isinstance(place, Place)
    return _shown(place, value)
