"""What one page sees and asks for.  It reads no clock and no socket: texts of messages in, texts out."""

from __future__ import annotations

from base64 import b64encode
from collections import deque
from collections.abc import Callable, Generator
from pathlib import PurePath
from typing import Any

from fbvm.base.areas import FLAG_AREAS
from fbvm.base.types import BOOL
from fbvm.live.futures import REPEATED
from fbvm.live.lesson import LiveLesson
from fbvm.live.look import STEP, Look, find_names
from fbvm.live.messages import ACTIONS, VERSION, MessageError, dump, dump_in_steps, message_id, parse
from fbvm.live.plcs import LivePlc
from fbvm.live.program import source_of
from fbvm.live.symbols import parts, row, search
from fbvm.live.updates import Updates, shown
from fbvm.live.workbench import MEASURES, REFUSED, Workbench
from fbvm.machine.state import Mode
from fbvm.net.faults import NAMED
from fbvm.record.draw.why import cause_text, why
from fbvm.record.recording.scans import RecordedScans
from fbvm.watch.names import is_single
from fbvm.watch.paths import Place

MOST_WAITING = 50
"""Questions of a page whose replies are under way."""
MOST_HISTORY, WHY_SCANS = 500, 300
"""Scans that are executed again for a trend, and for the cause of a value."""

Reply = Generator[None, None, dict[str, Any]]
"""A reply that is worked out in steps."""


class Session:
    """A page's session at a workbench.  `answer` takes a message and returns the reply; `update` is what has changed."""

    def __init__(self, workbench: Workbench) -> None:
        self._bench = workbench
        self._seen = Look(next(iter(workbench.plcs.values())))
        self._updates = Updates(workbench, self._seen)
        self._held: dict[tuple[str, str], int] = {}
        """What the page holds TRUE: PLC and variable, and the number of the scan that sees it first."""
        self._replies: deque[Generator[None, None, str]] = deque()
        """Replies that take longer."""
        self._actions: dict[str, Callable[..., Any]] = {
            "hello": self._hello, "ready": self._take, "look": self._look, "program": self._program, "source": self._source,
            "search": self._search, "parts": self._parts, "history": self._history, "why": self._why, "test": self._test,
            "capture": self._capture, "group": self._keep_group, "view": self._view, "branch": self._branch, "write": self._write,
            "force": workbench.force, "release": workbench.release, "run": self._run, "pause": workbench.pause,
            "step": self._step, "statement": self._statement, "break": workbench.set_breakpoint,
            "unbreak": workbench.remove_breakpoint, "speed": workbench.speed, "mode": workbench.set_mode,
            "start": workbench.start, "cable": workbench.cable, "fault": workbench.add_fault, "mend": workbench.mend,
            "restart": workbench.restart, "predict": self._predict, "check": self._check, "solution": self._solution,
        }  # fmt: skip

    # --- messages -----------------------------------------------------------------------------------------------------

    def answer(self, text: str) -> str | None:
        """The reply to a message; None if it takes longer: then it is among the next texts of `update`.

        A message that cannot be understood or done gets an error, and raises nothing."""
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
            if self._seen.past and action in ("write", "force", "release"):
                raise MessageError(f"this is scan {self._seen.past[0]}, which is past: go back to now, or on from here, first")
            fields = {name: value for name, value in message.items() if value is not None}
            order = self._bench.order(action, fields)
            done = self._actions[action](**fields)
            if action in REPEATED:
                self._bench.orders.append(order)
            if isinstance(done, Generator):
                if len(self._replies) >= MOST_WAITING:
                    raise MessageError("too many questions wait for their replies")
                reply = self._reply(number, done)
                if not self._replies:  # what is short is answered at once
                    next(reply)
                self._replies.append(reply)
                return None
        except StopIteration as ended:
            whole: str = ended.value
            return whole
        except (MessageError, *REFUSED) as error:
            return dump({"re": number if number is not None else message_id(text), "error": str(error)})
        return dump({"re": number, "ok": done if done is not None else {}})

    def _reply(self, number: int | None, steps: Generator[None, None, Any]) -> Generator[None, None, str]:
        """The text of a reply that is worked out and written in steps."""
        try:
            done = yield from steps
        except (MessageError, *REFUSED) as error:
            return dump({"re": number, "error": str(error)})
        return (yield from dump_in_steps({"re": number, "ok": done if done is not None else {}}))

    @property
    def is_behind(self) -> bool:
        """True if a reply or an update has been begun and is not whole yet."""
        return bool(self._replies) or self._updates.is_under_way

    def update(self, now_ns: int, is_late: Callable[[], bool] = lambda: False) -> str | None:
        """The next text for the page: a reply that took longer, or what has changed.  None if there is none, or if `is_late` says
        that time is up; then it is gone on with at the next call.  `now_ns` is the host's time."""
        while self._replies:
            try:
                next(self._replies[0])
            except StopIteration as ended:
                self._replies.popleft()
                whole: str = ended.value
                return whole
            if is_late():
                return None
        return self._updates.next(now_ns, is_late)

    @property
    def live(self) -> LivePlc:
        """The PLC that the page looks at."""
        return self._seen.live

    @property
    def shows_inside(self) -> bool:
        """True if the page shows rungs and charts of the present."""
        return bool(self._seen.instance) and not self._seen.past

    def begin_again(self) -> None:
        """Tells the page, which was in the session before this one, that other PLCs run now: it says hello once more."""
        self._updates.begins_again = self._updates.is_ready = True

    def end(self) -> None:
        """The page has gone, and holds nothing any more."""
        for (plc, name), scan in self._held.items():
            self._bench.let_go_later(plc, name, scan)
        self._held.clear()
        self._updates.is_ready = False
        self._seen.leave_past()

    def _hello(self, version: int = VERSION) -> dict[str, Any]:
        if version != VERSION:
            raise MessageError(f"this fbvm speaks version {VERSION} of its messages, not {version}")
        self._updates.forget()
        self._updates.frames = self._updates.acts = 0
        self._updates.is_ready = True
        bench = self._bench
        return {
            "version": VERSION, "read_only": bench.read_only, "writable": bench.writable,
            "real": any(live.is_real for live in bench.plcs.values()), "tests": bench.make_test is not None,
            "branches": bench.can_branch, "futures": [future.name for future in bench.futures],
            "lesson": bench.lesson.about() if bench.lesson else None,
            "pictures": bench.pictures is not None and bool(bench.pictures.shown), "groups": bench.groups is not None,
            "modes": [mode.value for mode in Mode], "faults": {name: kind.meaning for name, kind in NAMED.items()},
            "measures": MEASURES,
            "plcs": [{"name": live.name, "cycle": live.plc.cycle_ns, "watch": list(live.watch), "instances": live.instances,
                      "areas": {name: area.size_bytes // 2 for name, area in live.plc.memory.areas.items()
                                if area.unit_bits == 16 and name not in FLAG_AREAS},
                      "units": [attached.unit.name for attached in live.plc.units]} for live in bench.plcs.values()],
        }  # fmt: skip

    def _take(self) -> None:
        """The page has shown the last update."""
        self._updates.is_ready = True

    def _look(self, plc: str, names: list[str] | None = None, instance: str | None = None, memory: str | None = None,
              first: int = 0, units: bool = False, network: bool = False, scan: bool = False,
              pictures: bool = False, times: bool = False, plant: bool = False) -> Reply:  # fmt: skip
        """From now on the page sees these names and panels, and nothing else; `scan` wants to see inside scans."""
        live, look = self._bench.plc(plc), self._seen
        if memory is not None and memory not in live.plc.memory.areas:
            raise MessageError(f"this PLC has no area {memory[:10]!r}")
        found, unknown = yield from find_names(self._bench, live, names or [])
        rows = {}
        for number, (name, (owner, place)) in enumerate(found.items(), 1):
            rows[name] = row(place, owner.said)
            if number % STEP == 0:
                yield
        if live is not look.live:
            look.leave_past()
        if live is not look.live or not network:
            self._updates.frames = 0
        look.live, look.names, look.instance = live, found, (instance or "") if scan else ""
        look.memory = (memory, max(0, first)) if memory else None
        look.units, look.network, look.pictures, look.times, look.plant = units, network, pictures, times, plant
        self._look_anew()
        if look.instance and live.view is None:
            live.wish_view(self._bench.control.is_paused)
        return {"unknown": unknown, "rows": rows}

    def _look_anew(self) -> None:
        self._updates.forget()
        self._updates.look_at_once()

    def _leave_past(self) -> None:
        if self._seen.past:
            self._seen.leave_past()
            self._look_anew()

    # --- questions ----------------------------------------------------------------------------------------------------

    def _program(self, plc: str) -> dict[str, Any]:
        return {"instances": self._bench.plc(plc).instances}

    def _source(self, plc: str, instance: str) -> Reply:
        live = self._bench.plc(plc)
        return source_of(live.plc.image, live.plc.memory.areas, live.texts, instance)

    def _search(self, plc: str, text: str) -> Reply:
        live = self._bench.plc(plc)
        return search(live.plc, live.described, live.said, text)

    def _parts(self, plc: str, name: str) -> Reply:
        live = self._bench.plc(plc)
        return {"parts": (yield from parts(live.plc, live.said, name))}

    def _history(self, plc: str, names: list[str], scans: int) -> dict[str, Any]:
        """The values of some names in the last recorded scans, or the last before the one that is looked at."""
        live = self._quiet(plc)
        held = live.recorded.scans
        past = self._past_of(live)
        stop = held.stop if past is None else past + 1
        wanted = range(max(held.start, stop - min(max(1, scans), MOST_HISTORY)), stop)
        places = [place for name in names[:50] if isinstance(place := live.plc.find(name), Place) and is_single(place)]
        rows: list[list[str]] = [[] for _ in places]
        times: list[int] = []
        for moment in live.past.moments(wanted):
            times.append(moment.now_ns)
            for made, place in zip(rows, places, strict=True):
                made.append(shown(place, live.names.read(moment.read, place)))
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
        past = self._past_of(live)
        scan = held.stop - 1 if past is None else past
        trace = RecordedScans(live.recorded, live.past.lines, first=max(held.start, scan - WHY_SCANS))
        text = cause_text(trace, why(trace, place, scan))
        for file in live.texts:  # a page has little room for folders
            text = text.replace(f"{file}:", f"{PurePath(file).name}:")
        return {"text": text}

    def _test(self, plc: str) -> dict[str, Any]:
        """The acts so far as a pytest, with the values that the page sees now."""
        live = self._bench.plc(plc)
        if self._bench.make_test is None:
            raise MessageError("a test repeats runs in virtual time; others are repeated by `fbvm replay`: --trace FILE")
        seen = [(owner, place.name) for owner, place in self._seen.names.values()
                if isinstance(place, Place) and is_single(place)]  # fmt: skip
        return {"text": self._bench.make_test(self._bench.acts, live, seen)}

    def _quiet(self, plc: str) -> LivePlc:
        """A PLC whose past may be executed again now: with real connections that must not take time from its scans."""
        live = self._bench.plc(plc)
        if live.is_real and not self._bench.control.is_paused:
            raise MessageError("pause first: while real connections are served no scan is executed again")
        return live

    def _past_of(self, live: LivePlc) -> int | None:
        """The scan of a PLC that the page looks at; None if that is the present, or a scan of another PLC."""
        return self._seen.past[0] if self._seen.past and live is self._seen.live else None

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
        if self._seen.past is None or self._seen.other is not None:
            raise MessageError("look at a scan of the present run first: another future begins behind it")
        self._bench.branch(plc, self._seen.past[0] + 1)

    def _capture(self, plc: str) -> dict[str, Any]:
        """What has passed the network last, as a file for Wireshark."""
        return {"pcapng": b64encode(self._bench.plc(plc).capture()).decode()}

    def _view(self, plc: str, scan: int | None = None, future: int | None = None) -> Reply:
        """Looks at the end of a recorded scan, also of another future, or, without one, at the present again.  It is no earlier
        than what was asked to be looked at before."""
        yield from ()
        if scan is None:
            self._seen.leave_past()
            self._look_anew()
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
        look = self._seen
        look.live, look.other, look.past = live, other, (scan, seen.recorded.at(scan + 1))
        look.past_view = seen.past_view(scan) if look.instance else None
        self._look_anew()
        return {"scan": scan}

    def _write(self, plc: str, name: str, value: str, held: bool = False) -> dict[str, Any]:
        """Writes a value; one that is `held` is FALSE again when the page has gone, unless it has written another value."""
        live = self._bench.plc(plc)
        if held and (kind := getattr(live.plc.find(name), "type", None)) is not BOOL:
            raise MessageError(f"{name} is {kind or 'a range'}; only a BOOL is held")
        done = {"value": self._bench.write(plc, name, value), "scan": live.plc.scans}
        self._held.pop((plc, name), None)
        if held:
            self._held[plc, name] = live.plc.scans
        return done

    def _keep_group(self, name: str, names: list[str]) -> None:
        self._bench.keep_group(name, names)

    def _run(self) -> None:
        self._leave_past()
        self._bench.go_on()

    def _statement(self, plc: str) -> None:
        self._leave_past()
        self._bench.step_statement(plc)

    def _step(self, scans: int) -> None:
        self._leave_past()
        self._bench.step(scans)
        if self._seen.instance:
            self._seen.live.wish_view(True)
