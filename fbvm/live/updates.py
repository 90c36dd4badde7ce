"""What has changed for one page, worked out in short steps between scans.

An update is of one moment: the memory of the PLC is copied first, which takes some microseconds, and read from the copy while
further scans are executed."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import asdict
from itertools import islice
from typing import Any

from fbvm.base.memory import Memory
from fbvm.live.look import Look
from fbvm.live.messages import dump
from fbvm.live.plcs import LivePlc
from fbvm.live.program import PowerView, ScanView
from fbvm.live.stops import halt_row, shown_breakpoints
from fbvm.live.workbench import Workbench, fault_rows
from fbvm.watch import places
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
STEP = 8
"""Values that are read and written out in one step: less than a tenth of a millisecond."""
ACTS = 100
MOST_LINKS = 200
"""Pairs of addresses between which the plant shows what has passed."""
Steps = Generator[None, None, None]


class Updates:
    """The updates of a page of `bench` that looks at `look`."""

    def __init__(self, bench: Workbench, look: Look) -> None:
        self._bench, self._look = bench, look
        self.is_ready = False
        """True if the page has taken the last update."""
        self.begins_again = False
        """True if the next update says that the page has to begin again."""
        self._begun_ns = self._viewed_ns = -VIEW_NS
        self._known: dict[str, Any] = {}
        """What the page knows: values by name, other parts by theirs."""
        self.frames = self.acts = 0
        """Frames and acts that the page has been told."""
        self._work: Generator[None, None, str | None] | None = None
        self._copies: dict[LivePlc, Memory] = {}

    @property
    def is_under_way(self) -> bool:
        """True if an update has been begun and is not whole yet."""
        return self._work is not None

    def forget(self) -> None:
        """The page is told everything anew, because it looks at something else."""
        self._known, self._work, self._viewed_ns = {}, None, -VIEW_NS

    def look_at_once(self) -> None:
        """The next update need not wait: the page looks at something else, or has done something."""
        self._begun_ns = -VIEW_NS

    def next(self, now_ns: int, is_late: Callable[[], bool]) -> str | None:
        """The next update as a text, if it is whole before `is_late` says that time is up; else it is gone on with at the next
        call.  None if nothing has changed, if the page has not taken the last one, or if that was begun less than 100 ms ago."""
        if self._work is None:
            if not self.is_ready or now_ns - self._begun_ns < UPDATE_NS:
                return None
            self._begun_ns = now_ns
            if self.begins_again:
                self.begins_again = False
                return dump({"update": {"restarted": True}})
            self._work = self._steps(now_ns)
        while True:
            try:
                next(self._work)
            except StopIteration as ended:
                self._work = None
                text: str | None = ended.value
                if text is not None:
                    self.is_ready = False
                return text
            if is_late():
                return None

    def _is_new(self, name: str, value: Any) -> bool:
        if name in self._known and self._known[name] == value:
            return False
        self._known[name] = value
        return True

    def _steps(self, now_ns: int) -> Generator[None, None, str | None]:
        look = self._look
        pictures = self._bench.pictures.places if look.pictures and self._bench.pictures else {}
        for live in {look.live, *(live for live, _ in (*look.names.values(), *pictures.values()))}:
            self._copy(live)
        view = look.past_view if look.past else look.live.view_of(look.instance) if look.instance else None
        made = {**self._state(), **self._small_panels(now_ns)}
        yield
        yield from self._panels(made, view)
        changed = {name: value for name, value in made.items() if self._is_new(name, value)}
        yield
        values: dict[str, str] = {}
        waiting = iter(list(look.names.items()))
        while part := list(islice(waiting, STEP)):
            for name, (live, place) in part:
                text = self._text(live, place)
                if self._is_new(f"={name}", text):
                    values[name] = text
            yield
        if values:
            changed["values"] = values
        return dump({"update": changed}) if changed else None

    # --- values -------------------------------------------------------------------------------------------------------

    def _copy(self, live: LivePlc) -> None:
        """Keeps the memory of a PLC as it is now."""
        memory = live.plc.memory
        copy = self._copies.get(live)
        if copy is None or copy.size != memory.size:
            copy = self._copies[live] = Memory(memory.size, memory.areas)
        copy.u8[:] = memory.u8

    def _memory(self, live: LivePlc) -> Memory:
        """The memory of a PLC at the moment of the update, or as it was."""
        return self._look.seen.memory if self._look.past and live is self._look.live else self._copies[live]

    def _read(self, live: LivePlc, place: Place | Span) -> Value:
        return places.read_found(self._memory(live), place)

    def _text(self, live: LivePlc, place: Place | Span) -> str:
        if isinstance(place, Span):
            return f"[{', '.join(shown(one, self._read(live, one)) for one in place.places[:64])}]"[:MOST_SHOWN]
        return shown(place, self._value(live, place))

    def _value(self, live: LivePlc, place: Place) -> Value:
        return live.names.read(lambda one: self._read(live, one), place)

    # --- the parts of an update ---------------------------------------------------------------------------------------

    def _state(self) -> dict[str, Any]:
        look, control = self._look, self._bench.control
        live, past = look.live, look.past
        plc, held = live.plc, (look.other or live).recorded.scans
        trap = plc.trap.told(live.names.instance) if plc.trap else ""
        return {
            "plc": live.name, "state": "past" if past else live.state(control.stands), "mode": plc.mode.value,
            "speed": control.speed, "trap": trap,
            "scan": past[0] if past else plc.scans - 1, "ns": past[1].now_ns if past else plc.now_ns,
            "halt": halt_row(live, plc.halted) if plc.halted and not past else None,
            "breaks": [f"{row.kind} {row}" + (f" at passes {row.hits}" if row.hits else "") for row in shown_breakpoints(live)],
            "held": [held.start, held.stop - 1], "taken": str(plc.scan_times),
            "forces": {name: _plain(live, name, value) for name, value in look.seen.forces.items()},
        }  # fmt: skip

    def _small_panels(self, now_ns: int) -> dict[str, Any]:
        """What is worked out in no time."""
        look, bench, made = self._look, self._bench, dict[str, Any]()
        live = look.live
        if look.instance and not look.past and not bench.held_by and now_ns - self._viewed_ns >= VIEW_NS:
            self._viewed_ns = now_ns
            live.wish_view(bench.control.is_paused)
        if look.memory:
            area, first = look.memory
            words = self._memory(live).words(area)
            made["memory"] = {"area": area, "first": first, "words": list(words[first : first + MEMORY_WORDS]),
                              "forced": sorted(self._forced_words(area, first))}
        if look.network:
            made["faults"] = fault_rows(bench.faults)
            rows = live.frame_rows(self.frames, None)
            if rows:
                made["frames"], self.frames = rows, rows[-1]["number"] + 1
        if look.times:
            made["times"] = live.plc.scan_times.bins
        if look.plant:
            made["plant"] = plant_rows(bench)
        if bench.changes:
            made["change"] = bench.changes.state
        if bench.groups:
            made["groups"] = bench.groups.rows
        acts = bench.acts[self.acts :][-ACTS:]
        if acts:
            made["acts"] = [[act.plc, act.scan, act.text] for act in acts if act.what != "keep"]
            self.acts = len(bench.acts)
        return made

    def _forced_words(self, area: str, first: int) -> set[int]:
        """The words in which something is forced, counted from `first`."""
        live, found = self._look.live, set[int]()
        begin = live.plc.memory.areas[area].offset + 2 * first
        for name in self._look.seen.forces:
            place = live.plc.find(name)
            if isinstance(place, Place):
                low, high = (place.offset - begin) // 2, (place.offset + max(1, place.type.size) - 1 - begin) // 2
                found |= {word for word in range(low, high + 1) if 0 <= word < MEMORY_WORDS}
        return found

    def _panels(self, made: dict[str, Any], view: ScanView | PowerView | None) -> Steps:
        """What takes longer."""
        look = self._look
        if look.instance and view:
            made["inside"] = yield from view.steps_of(look.instance)
        if look.units:
            made["units"] = []
            for attached in list(look.live.plc.units):
                yield from self._unit(attached, made["units"])
        pictures = self._bench.pictures
        if look.pictures and pictures:
            made["pictures"], made["picture"] = pictures.shown, {}
            for number, (key, (live, place)) in enumerate(list(pictures.places.items())):
                if live in self._copies:
                    made["picture"][key] = show(place.type, self._value(live, place), place.hexadecimal)
                if number % STEP == STEP - 1:
                    yield

    def _unit(self, attached: Any, rows: list[dict[str, Any]]) -> Steps:
        """A unit as the panel shows it: its words and bits, with what they are called and what they mean."""
        unit, live = attached.unit, self._look.live
        words = []
        for number, (address, said) in enumerate(getattr(unit, "descriptions", {}).items()):
            place = live.plc.find(address)
            value = self._read(live, place)
            if isinstance(place, Place):
                meaning = live.meanings.get(address, {}).get(value, "") if isinstance(value, int) else ""
                words.append([address, said, shown(place, value), meaning])
            if number % STEP == STEP - 1:
                yield
        shows = getattr(unit, "front", None)
        rows.append({"name": unit.name, "address": unit.address, "plugged": self._bench.is_plugged(attached), "words": words,
                     "front": asdict(shows(self._memory(live))) if shows else None})


def shown(place: Place, value: Value) -> str:
    """A value as a literal, cut if it is very long."""
    text = show(place.type, value, place.hexadecimal)
    return text if len(text) <= MOST_SHOWN else f"{text[: MOST_SHOWN - 1]}…"


def _plain(live: LivePlc, name: str, value: Value) -> str:
    place = live.plc.find(name)
    assert isinstance(place, Place)
    return shown(place, value)


def plant_rows(bench: Workbench) -> dict[str, Any]:
    """All PLCs of a run with their state and units; `links` between addresses with the number of frames and the last one;
    `doors`, the host's endpoints of units; `faults`, the addresses at which one is on."""
    stands = bench.control.stands
    plcs = [{"name": live.name, "state": live.state(stands), "mode": live.plc.mode.value, "scan": live.plc.scans - 1,
             "trap": live.plc.trap.told(live.names.instance) if live.plc.trap else "",
             "units": [{"name": attached.unit.name, "address": attached.unit.address, "plugged": bench.is_plugged(attached)}
                       for attached in live.plc.units]} for live in bench.plcs.values()]  # fmt: skip
    links: dict[str, list[Any]] = {}
    for live in bench.plcs.values():
        for ends, passed in live.traffic.items():
            if passed.frames > links[ends][2] if ends in links else len(links) < MOST_LINKS:  # both ends may have a PLC
                links[ends] = [passed.one, passed.other, passed.frames, passed.info]
    doors = [[str(endpoint), str(real)] for network in bench.networks
             for endpoint, real in getattr(network, "doors", {}).items()]  # fmt: skip
    faults = sorted({row.peer.host for row in bench.faults})
    return {"plcs": plcs, "links": list(links.values()), "doors": doors, "faults": faults}
