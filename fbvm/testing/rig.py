"""The test rig: a block or a program on a PLC in virtual time, whose variables are written and read by name.

    pump = fb("src/pump.st::Pump", cycle="10ms")
    pump.scan(Start=True)
    pump.until("Running", max="2s")
    assert pump["Delay.Q"] and pump.Delay.ET == ns("50ms")
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any

from fbvm.base.types import fold
from fbvm.check.lint.suppression import ANY, Wanted
from fbvm.engine.trap import Trap
from fbvm.machine.plc import Mode, Plc
from fbvm.net.loop import LoopNetwork
from fbvm.record.draw.chart import Chart, draw
from fbvm.record.recording.recording import PlcRecording, Recording
from fbvm.record.trace.packets import Dissector, Packet, add_tap
from fbvm.record.trace.recorder import Recorder
from fbvm.run.varied import VariedPlc, VariedRun
from fbvm.testing.pages import write_page
from fbvm.testing.reads import VariableReads
from fbvm.testing.report import Report
from fbvm.testing.subject import Stub, Subject, subject
from fbvm.testing.value_types import for_writing
from fbvm.testing.values import Values, property_value, value_of, write
from fbvm.units.contract import Unit
from fbvm.units.etn21.unit import Etn21
from fbvm.watch.conditions import parse_condition
from fbvm.watch.names import Names
from fbvm.watch.paths import Place, Span, UnknownPlace, find, find_place
from fbvm.watch.values import Value, parse_time_ns, show_time
from fbvm.wire.tap import TapEvent

MOST_PACKETS = 10_000
"""Packets that are kept for the page of a failure."""
MOST_SHOWN = 6
"""Packets that the report of a failure lists."""
DEFAULT_LIMIT = "1m"
"""The default of `max` of `until`, in virtual time."""


class Trapped(AssertionError):
    """A trap has stopped the program; `trap` has its position and reason."""

    def __init__(self, trap: Trap, message: str = "") -> None:
        super().__init__(message or trap.message)
        self.trap = trap


class Forced:
    """Forces that end with a `with` block."""

    def __init__(self, rig: Rig, names: Sequence[str]) -> None:
        self._rig, self._names = rig, names

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._rig.unforce(*self._names)


class Ambiguous:
    """A method of the rig whose name a variable has, too: it can be called; a use as a value raises TypeError."""

    def __init__(self, method: Callable[..., Any], name: str) -> None:
        self._method, self._said = method, f"a variable is called {name}, too: write rig[{name!r}] for its value"

    def __call__(self, *args: Any, **named: Any) -> Any:
        return self._method(*args, **named)

    def __bool__(self) -> bool:
        raise TypeError(self._said)

    def __eq__(self, other: object) -> bool:
        raise TypeError(self._said)

    __hash__ = None  # type: ignore[assignment]


class Rig:
    """One PLC with a block or a program under test.  Names are looked up there first, then in the whole PLC.

    Variables are attributes (`rig.Done`, `rig.Start = True`) and items (`rig["m.ET"]`, `rig["D200"]`); an item is
    needed for a name that is a method of this class.  Times are text ("50ms") or integers of nanoseconds."""

    plc: Plc
    subject: Subject
    network: LoopNetwork
    _recorded: PlcRecording
    _reads: VariableReads
    _timed: list[tuple[int, str, object]]
    _report: Report
    _packets: deque[tuple[int, Packet]]
    _varied: VariedPlc | None

    def __init__(self, what: Subject, cycle: str | int = "10ms", *, stubs: Mapping[str, Stub] | None = None,
                 units: Sequence[Unit] = (), etn21: str = "", network: LoopNetwork | None = None,
                 plc: Plc | None = None, recording: Recording | None = None, plc_name: str = "",
                 varied: VariedRun | None = None) -> None:  # fmt: skip
        set_ = object.__setattr__
        cycle_ns = to_ns(cycle)
        plc = plc or Plc(what.image, varied.cycle_ns(plc_name, cycle_ns) if varied else cycle_ns)
        set_(self, "plc", plc)
        set_(self, "subject", what)
        set_(self, "_recorded", (recording or Recording()).add(what.name, plc))
        set_(self, "_reads", VariableReads())
        set_(self, "_timed", [])
        set_(self, "network", network or LoopNetwork())
        set_(self, "_report", Report(plc, what, self._recorded, self._reads))
        for name, stub in (stubs or {}).items():
            if callable(stub):
                self._stub(name, stub)
        set_(self, "_packets", deque(maxlen=MOST_PACKETS))
        if units or etn21 or plc.units:
            add_tap(self.network, partial(self._tap, Dissector()))
        how: dict[str, Any] = {"timing": varied.timing(plc_name), "seed": varied.conditions.seed} if varied else {}
        for unit in (*units, *([Etn21(0, etn21, **how)] if etn21 else ())):
            plc.attach(unit, self.network)
        for name in self._report.names_in(what.prefix):
            if callable(method := getattr(type(self), name, None)):
                set_(self, name, Ambiguous(method.__get__(self), name))
        set_(self, "_varied", varied.made(plc_name, plc, self.find, self.network) if varied else None)

    @classmethod
    def of(cls, what: str, cycle: str | int = "10ms", *, block: bool = True, folders: Sequence[Path] = (),
           libraries: Sequence[Path] = (), sources: Sequence[str] = (), text: str = "",
           stubs: Mapping[str, Stub] | None = None, wanted: Wanted = ANY, dialect: str = "",
           **given: Any) -> Rig:  # fmt: skip
        """A rig by text: `"src/pump.st::Pump"`, `"src/pump.st"`, or `"TON"` from a library.

        Files are looked for in `folders`, or in the current folder; without `block` the rig runs the whole program of the
        file.  `libraries`, `sources`, `text` and `stubs` are as for the fixture `fb`; `wanted` selects the warnings,
        `dialect` is the dialect of the compiler.  Raises SubjectError with all diagnostics."""
        __tracebackhide__ = True
        file, mark, name = what.partition("::")
        if not mark and block and not file.lower().endswith(".st"):
            file, name = "", what
        files = []
        for path in (*([file] if file else []), *sources):
            files.append(_file(path, folders or [Path.cwd()]))
        near = [path.parent for path in files if path.parent not in (*libraries, Path.cwd(), *folders[1:])]
        made = subject(files, name if name or block else None, [*libraries, *dict.fromkeys(near)], stubs, text, wanted, dialect)
        return cls(made, cycle, stubs=stubs, **given)

    def _tap(self, dissector: Dissector, now_ns: int, unit: str, event: TapEvent) -> None:
        """Keeps the packets of the units of this PLC."""
        if any(attached.unit.address == unit for attached in self.plc.units):
            self._packets.extend((self.plc.scans, packet) for packet in dissector.dissect(now_ns, event))

    def _stub(self, name: str, stub: Callable[[Any], None]) -> None:
        numbers = [number for number, body in enumerate(self.plc.image.bodies) if fold(body.name) == fold(name)]
        if not numbers or self.plc.image.bodies[numbers[0]].kind != "FUNCTION_BLOCK":
            raise ValueError(f"{name} is no function block of this program; Python takes the place of blocks only")

        def run(base: int) -> None:
            place = self.plc.find(self._report.names.instance(base))
            assert isinstance(place, Place)
            stub(Values(self.plc, place, lambda place: None))

        self._recorded.substitute(numbers[0], run)

    def __repr__(self) -> str:
        return f"<{self.subject.name}, {self.plc.scans} scans, {show_time(self.plc.elapsed_ns)[2:]}>"

    # --- values

    def find(self, name: str) -> Place | Span:
        """The place or span that a name denotes.  Raises UnknownPlace."""
        __tracebackhide__ = True
        symbols, areas = self.plc.image.symbols, self.plc.memory.areas
        try:
            return find_place(symbols, areas, self.subject.path(name.strip()))
        except UnknownPlace as inner:
            try:
                return find(symbols, areas, name)
            except UnknownPlace as outer:
                whole = not self.subject.prefix or fold(name.partition(".")[0].strip()) in symbols
                raise UnknownPlace(self.subject.plain(str(outer if whole else inner))) from None

    def __getattr__(self, name: str) -> Any:
        __tracebackhide__ = True
        if name.startswith("__"):
            raise AttributeError(name)
        try:
            return self[name]
        except UnknownPlace as error:
            raise AttributeError(str(error)) from None

    def __getitem__(self, name: str) -> Any:
        __tracebackhide__ = True
        try:
            found = self.find(name)
        except UnknownPlace as unknown:
            return property_value(self.plc, self.subject.path(name.strip()), unknown)
        return value_of(self.plc, found, self._reads.add)

    def __setattr__(self, name: str, value: object) -> None:
        __tracebackhide__ = True
        try:
            self[name] = value
        except UnknownPlace as error:
            raise AttributeError(str(error)) from None

    def __setitem__(self, name: str, value: object) -> None:
        __tracebackhide__ = True
        self._write(self.find(name), value)

    def _write(self, place: Place | Span, value: object) -> None:
        __tracebackhide__ = True
        try:
            write(self.plc, place, value)
        except (TypeError, ValueError) as error:
            raise type(error)(self.subject.plain(str(error))) from None

    def write(self, inputs: Mapping[str, object] | None = None, /, **named: object) -> Rig:
        """Writes variables by name; names that are no Python identifiers by a mapping: `{"CIO 0.00": True}`."""
        __tracebackhide__ = True
        for name, value in {**(inputs or {}), **named}.items():
            self[name] = value
        return self

    # --- time

    def scan(self, inputs: Mapping[str, object] | None = None, /, **named: object) -> Rig:
        """Writes inputs, then executes one scan.  Raises Trapped."""
        __tracebackhide__ = True
        self.write(inputs, **named)
        self._scan()
        return self

    def run(self, time: str | int | None = None, /, *, scans: int | None = None, **named: object) -> Rig:
        """Writes inputs, then executes scans for `time` ("1s", or nanoseconds), or `scans` scans.  Raises Trapped."""
        __tracebackhide__ = True
        self.write(named)
        if (time is None) == (scans is None):
            raise TypeError('say how long: run("1s") or run(scans=10)')
        end_ns = self.elapsed_ns + to_ns(time) if time is not None else 0
        end = self.plc.scans + (scans or 0)
        while self.plc.scans < end or self.elapsed_ns < end_ns:
            self._scan()
        return self

    def until(self, condition: str | Callable[[Rig], object], /, *, max: str | int = DEFAULT_LIMIT, **named: object) -> Rig:
        """Writes inputs, then executes scans until a condition holds after one: `"m.Done AND Count > 5"` or a function.

        Raises AssertionError if it does not hold within `max`, Trapped after a trap."""
        __tracebackhide__ = True
        self.write(named)
        holds = self._holds(condition)
        end_ns = self.elapsed_ns + to_ns(max)
        while True:
            self._scan()
            if holds():
                return self
            if self.elapsed_ns >= end_ns:
                said = condition if isinstance(condition, str) else getattr(condition, "__name__", "the condition")
                raise AssertionError(f"{said} does not hold within {show_time(to_ns(max))[2:]}")

    def at(self, time: str | int, inputs: Mapping[str, object] | None = None, /, **named: object) -> Rig:
        """Schedules a write before the first scan at or after `time`, which counts from power-on."""
        for name, value in {**(inputs or {}), **named}.items():
            found = self.find(name)
            if isinstance(found, Place):
                for_writing(found.type, value, self.subject.plain(found.name))
            self._timed.append((to_ns(time), name, value))
        self._timed.sort(key=lambda row: row[0])
        return self

    def _holds(self, condition: str | Callable[[Rig], object]) -> Callable[[], bool]:
        if callable(condition):
            function = condition
            return lambda: bool(function(self))
        parsed = parse_condition(condition, self.find)

        def read(place: Place) -> Value:
            self._reads.add(place)
            return self.plc.read(place)

        return lambda: parsed.holds(read)

    def _scan(self) -> None:
        __tracebackhide__ = True
        self.disturb()
        while self._timed and self._timed[0][0] <= self.elapsed_ns:
            _, name, value = self._timed.pop(0)
            self[name] = value
        self._reads.clear()
        trap = self.plc.scan(self._varied.elapsed_ns if self._varied else None)
        if trap:
            raise Trapped(trap, trap.told(Names.of(self.plc.image, self.plc.memory.areas).instance))
        if self._varied:
            self._varied.after_scan()

    def disturb(self) -> None:
        """Does what a campaign does to the PLC before its next scan, which begins later if the power is cut."""
        if self._varied:
            self._varied.before_scan()

    @property
    def scans(self) -> int:
        """The number of scans since power-on."""
        return self.plc.scans

    @property
    def elapsed_ns(self) -> int:
        """The time since power-on in nanoseconds, at which the next scan begins."""
        return self._varied.elapsed_ns if self._varied else self.plc.elapsed_ns

    # --- power, mode, forces

    def power_on(self) -> Rig:
        """Switches power off and on; retained variables keep their values."""
        self.plc.warm_start()
        return self

    def cold_start(self) -> Rig:
        """Switches power on as for a new PLC: all variables have their initial values."""
        self.plc.cold_start()
        return self

    def mode(self, mode: str) -> Rig:
        """Sets the operating mode.  "PROGRAM": units are refreshed, the program is not executed; "RUN" after it clears variables
        that are not retained."""
        self.plc.mode = Mode(mode.upper())
        return self

    def force(self, values: Mapping[str, object] | None = None, /, **named: object) -> Forced:
        """Forces variables until `unforce`, or to the end of a `with` block.  A test that leaves a force fails."""
        __tracebackhide__ = True
        given = {**(values or {}), **named}
        for name, value in given.items():
            place = self.find(name)
            self._write(place, value)
            self.plc.force(place.name, self.plc.read(place))
        return Forced(self, list(given))

    def unforce(self, *names: str) -> Rig:
        """Ends forces, all of them if none is named."""
        for name in names:
            self.plc.unforce(self.find(name).name)
        if not names:
            self.plc.unforce()
        return self

    # --- charts and reports

    def chart(self, *signals: str, scans: int) -> Chart:
        """Executes `scans` scans and draws the signals, as `fbvm.chart` does."""
        places = [self.find(name) for name in signals]
        recorder = Recorder(self.plc, [place.name for place in places])
        try:
            self.run(scans=scans)
        finally:
            recorder.stop()
        return draw(recorder.relabelled(self.subject.prefix))

    def table(self, *signals: str, scans: int = 10) -> str:
        """The scan table of the last `scans` scans: the changes of these variables, statement by statement."""
        places = [self.find(name) for name in signals]
        return self._report.table([place for place in places if isinstance(place, Place)], scans)

    @property
    def reads(self) -> list[tuple[str, int, Place]]:
        """The variables that the test has read since the last scan: file, line, place."""
        return self._reads.rows

    def explain(self, lines: tuple[str, range] | None = None) -> str:
        """The report of a failed test: the variables that it has read, their last changes and the statements of these.

        `lines` are a file and lines of it; without them all variables are reported that were read since the last scan."""
        said = self._report.text(lines)
        if said and self._packets:
            rows = [f"  scan {scan:<4} {packet}" for scan, packet in list(self._packets)[-MOST_SHOWN:]]
            said += "\n\n" + "\n".join(["what passed the network last:", *rows])
        return said

    def write_page(self, path: Path, title: str, lines: tuple[str, range] | None = None, failure: str = "") -> bool:
        """Writes the last scans as one HTML file, which shows the variables that `lines` have read, and `failure`, the text of
        the failed assertion; returns False without a scan."""
        return write_page(path, title, self._recorded, self.subject, self._reads.places(*(lines or ())), failure)


def _file(path: str, folders: Sequence[Path]) -> Path:
    __tracebackhide__ = True
    for folder in folders:
        if (folder / path).exists():
            return folder / path
    raise not_found(path, folders)


def not_found(named: str, folders: Sequence[Path]) -> FileNotFoundError:
    """The error about a file that is in none of the folders; it names a file there that is called alike."""
    where = " nor in ".join(str(folder) for folder in folders)
    beside = [(folder / named).parent for folder in folders]
    there = {each.name for folder in beside if folder.is_dir() for each in folder.iterdir() if each.suffix == Path(named).suffix}
    hint = "".join(f"; did you mean {Path(named).with_name(each)}?" for each in get_close_matches(Path(named).name, there, 1))
    return FileNotFoundError(f"{named} is {'not' if len(folders) == 1 else 'neither'} in {where}{hint}")


def to_ns(time: str | int) -> int:
    """The nanoseconds of a time: text such as "50ms", or an integer of nanoseconds."""
    return parse_time_ns(time) if isinstance(time, str) else time
