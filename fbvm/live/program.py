"""What the program panel shows: the source of an instance with the variables on its lines, and its rungs and charts as they were
executed in one scan."""

from __future__ import annotations

import re
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from functools import partial
from itertools import islice
from typing import Any

from fbvm.base.types import BOOL, Field, StructType, base, fold
from fbvm.code.image import Image
from fbvm.machine.plc import Phase, Plc
from fbvm.machine.power import Power
from fbvm.record.draw.ladder_svg import rung_svg
from fbvm.record.draw.ladder_text import ladder_surface
from fbvm.record.draw.power import PowerFlow, RungExecution, latest_execution
from fbvm.record.draw.rung_values import RungValues
from fbvm.record.draw.sfc_recorder import ChartCall, ChartRecorder, active_steps
from fbvm.record.draw.sfc_text import sfc_surface
from fbvm.record.draw.table import ScanState
from fbvm.record.trace.events import Event, Statement
from fbvm.record.trace.recorder import Signal
from fbvm.syntax.ladder.drawing.widths import Annotations
from fbvm.watch.names import Names, is_single
from fbvm.watch.paths import Place, UnknownPlace, find
from fbvm.watch.scanner import code_of
from fbvm.watch.scopes import every_instance

MOST_INSTANCES, MOST_ELEMENTS = 2000, 100
"""Instances of a program that are listed, and elements of an array of them."""
MOST_PICTURES = 200
"""Rungs and charts of one instance that are drawn."""
MOST_ON_LINE = 8
"""Values beside one line."""
SITES, LINES = 200, 2
"""Statements, and lines of a source with their names, that are looked through in one step."""
RUNG_WIDTH = 90
MOST_DRAWN = 2000
"""Drawings that are kept; those with the same states and values are made once."""
Drawn = dict[tuple[object, ...], tuple[str, str]]
"""Headline and SVG of rungs and charts by their states."""
_PATH = re.compile(r"[^\W\d]\w*(?:\s*\.\s*[^\W\d]\w*|\[\s*\d+\s*\])*")
_END = re.compile(r"\bEND_(?:PROGRAM|FUNCTION_BLOCK|FUNCTION|METHOD)\b", re.IGNORECASE)


def instances(image: Image) -> list[dict[str, str]]:
    """Path and type of each program and function block instance that has statements, rungs or charts of its own."""
    kinds = {fold(body.name) for body in image.bodies}
    found = (place for place in every_instance(image.symbols, MOST_ELEMENTS) if "$" not in place.name)
    first = islice(found, MOST_INSTANCES)
    return [{"path": place.name, "pou": place.type.name} for place in first if fold(place.type.name) in kinds]


def source_of(image: Image, areas: Any, texts: Mapping[str, str], instance: str) -> Generator[None, None, dict[str, Any]]:
    """The source of an instance: file, number of the first line, and its lines, each with the names of the single values on it.
    Found in short steps.

    Raises UnknownPlace for what is no instance."""
    place = find(image.symbols, areas, instance)
    if not isinstance(place, Place) or not isinstance(place.type, StructType):
        raise UnknownPlace(f"{instance} is no instance of a program or a function block")
    pou = place.type.name.upper()
    sites: list[tuple[str, int]] = []
    for start in range(0, len(image.sites), SITES):
        sites += [(site.file, site.line) for site in image.sites[start : start + SITES] if site.pou.upper().split(".")[0] == pou]
        yield
    bodies = {*(rung.body for rung in image.rungs), *(chart.body for chart in image.charts)}
    drawn = any(image.bodies[body].name.upper() == pou for body in bodies)
    if not sites or sites[0][0] not in texts:
        return {"file": "", "first": 1, "lines": [], "drawn": drawn, "pou": place.type.name}
    file = sites[0][0]
    rows = texts[file].split("\n")
    yield
    numbers = [line for of, line in sites if of == file]
    first = yield from _begin(rows, min(numbers), place.type.name)
    last = min(len(rows), max(numbers) + 3)
    end = next((at for at in range(max(numbers) - 1, len(rows)) if _END.search(code_of(rows[at]))), last - 1)
    lines = []
    for row in rows[first - 1 : end + 1]:
        lines.append({"text": row, "names": list(_names_on(row, image.symbols, areas, instance))})
        if len(lines) % LINES == 0:
            yield
    return {"file": file, "first": first, "lines": lines, "drawn": drawn, "pou": place.type.name}


def _begin(rows: Sequence[str], line: int, pou: str) -> Generator[None, None, int]:
    """The line at which the declaration of a POU begins, whose first statement is on `line`."""
    head = re.compile(rf"\s*(PROGRAM|FUNCTION_BLOCK|FUNCTION)\b.*\b{re.escape(pou)}\b", re.I)
    for at in range(min(line, len(rows)) - 1, -1, -1):
        if head.match(rows[at]):
            return at + 1
        if at % SITES == 0:
            yield
    return 1


def _names_on(row: str, symbols: Mapping[str, Field], areas: Any, instance: str) -> Iterator[str]:
    """The full names of the single values that a line mentions, in order, each once."""
    seen: set[str] = set()
    for match in _PATH.finditer(code_of(row)):
        word = re.sub(r"\s", "", match[0])
        for path in (f"{instance}.{word}", word):
            try:
                place = find(symbols, areas, path)
            except (UnknownPlace, ValueError):
                continue
            if isinstance(place, Place) and is_single(place) and place.name.upper() not in seen and len(seen) < MOST_ON_LINE:
                seen.add(place.name.upper())
                yield path
            break


class ScanView:
    """A listener for one scan: which lines each instance executed, and its rungs and charts with power, as SVG."""

    def __init__(self, image: Image, areas: Any, names: Names, drawn: Drawn) -> None:
        self._image, self._names, self._drawn = image, names, Drawings(drawn)
        self._values = RungValues(image, areas)
        self._power = PowerFlow(image.rungs, lambda scan: True, self._values.keep)
        self._charts = ChartRecorder(image.charts, lambda scan: True)
        self.scan = -1
        self._executed: dict[int, set[int]] = {}

    def phase(self, plc: ScanState, phase: Phase) -> None:
        """Called at the end of a phase."""
        self._charts.phase(plc, phase)
        self.scan = plc.scans

    def event(self, plc: ScanState, event: Event) -> None:
        """Called for each event of the scan."""
        self._power.event(plc, event)
        self._charts.event(plc, event)
        if isinstance(event, Statement):
            self._executed.setdefault(event.frame.base, set()).add(event.site)

    def steps_of(self, instance: str) -> Generator[None, None, dict[str, Any]]:
        """What an instance did: numbers of the executed lines, and pictures with their headlines.  Drawn in short steps."""
        bases = {base for base in self._executed if self._names.instance(base).upper() == instance.upper()}
        lines = {self._image.sites[site].line for base in bases for site in self._executed[base]}
        pictures: dict[int, tuple[str, str]] = {}
        for made in self._power.executed:
            if self._names.instance(made.base).upper() == instance.upper() and len(pictures) < MOST_PICTURES:
                key = (made.picture.site, *sorted((step, tuple(seen)) for step, seen in made.states.items()),
                       *sorted(made.values.items(), key=repr))  # fmt: skip
                pictures[made.picture.site] = self._drawn.picture(key, partial(_rung, made, self._values.of(made)))
                yield
        for called in self._charts.calls:
            if self._names.instance(called.base).upper() == instance.upper() and len(pictures) < MOST_PICTURES:
                key = called.picture.site, tuple(sorted(called.tested.items())), called.active
                pictures[called.picture.site] = self._drawn.picture(key, partial(_chart, called))
                yield
        return {"scan": self.scan, "executed": sorted(lines), "pictures": [list(pictures[site]) for site in sorted(pictures)]}


class PowerView:
    """The rungs and charts of one instance as machine code has noted them at their latest evaluation, with the values at the end
    of the last scan; which lines were executed is not known."""

    def __init__(self, plc: Plc, power: Power, instance: str, drawn: Drawn) -> None:
        self._drawn, self.scan = Drawings(drawn), plc.scans - 1
        body, start = power.body(instance)
        elements = power.elements(instance)
        rungs = [latest_execution(rung, start, self.scan, elements) for rung in plc.image.rungs if rung.body == body]
        self._rungs = [(made, _values_now(plc, made, instance)) for made in rungs[:MOST_PICTURES] if made]
        by_site = {site: value for (site, _), value in elements.items()}
        self._charts = [
            ChartCall(self.scan, start, chart, {number: by_site[row[0]] for number, row in enumerate(chart.transitions)
                                               if row[0] in by_site}, active_steps(chart, start, plc))
            for chart in plc.image.charts if chart.body == body
        ]  # fmt: skip

    def steps_of(self, instance: str) -> Generator[None, None, dict[str, Any]]:
        """As `ScanView.steps_of`, of the instance of this view."""
        pictures: list[list[str]] = []
        for made, values in self._rungs:
            key = made.picture.site, *sorted((step, tuple(seen)) for step, seen in made.states.items()), *values.items()
            draw = partial(_rung, made, lambda step, operand, found=values: found.get((step, operand), ""))  # type: ignore[misc]
            pictures.append([*self._drawn.picture(key, draw)])
            yield
        for called in self._charts:
            key = called.picture.site, tuple(sorted(called.tested.items())), called.active
            pictures.append([*self._drawn.picture(key, partial(_chart, called))])
            yield
        return {"scan": self.scan, "executed": [], "pictures": pictures}


def _values_now(plc: Plc, made: RungExecution, instance: str) -> dict[tuple[int, str], str]:
    """The values of the operands of a rung that are no bits, by step and operand."""
    found = {}
    for step, (_, _, _, operands) in enumerate(made.picture.steps):
        for operand in operands:
            for path in (f"{instance}.{operand}", operand.lstrip("%")):
                try:
                    place = plc.find(path)
                except (UnknownPlace, TypeError, ValueError):
                    continue
                if isinstance(place, Place) and is_single(place) and base(place.type) is not BOOL:
                    found[step, operand] = Signal(place, place.name).text(plc.read(place)).replace(" ", "")
                break
    return found


class Drawings:
    """Pictures of rungs and charts, each made once for the same states and values."""

    def __init__(self, drawn: Drawn) -> None:
        self._drawn = drawn

    def picture(self, key: tuple[object, ...], draw: Callable[[], tuple[str, str]]) -> tuple[str, str]:
        """The headline and the SVG of a key, made by `draw` if it is new."""
        if key not in self._drawn:
            if len(self._drawn) >= MOST_DRAWN:
                self._drawn.clear()
            self._drawn[key] = draw()
        return self._drawn[key]


def _rung(made: RungExecution, values: Callable[[int, str], str]) -> tuple[str, str]:
    head, surface = ladder_surface(made.picture, RUNG_WIDTH, Annotations(made.states, values=values))
    return head, rung_svg(surface) if made.picture.steps else ""


def _chart(called: ChartCall) -> tuple[str, str]:
    return "", rung_svg(sfc_surface(called.picture, RUNG_WIDTH, called.state))
