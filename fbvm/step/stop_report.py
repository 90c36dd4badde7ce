"""The texts of a stop: the position, the source around it, changed values, rungs, charts, calls."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from fbvm.base.types import StructType, base
from fbvm.code.image import Site
from fbvm.record.draw.ladder_text import ladder_text
from fbvm.record.draw.sfc_recorder import active_steps
from fbvm.record.draw.sfc_text import ChartState, sfc_text
from fbvm.record.trace.events import Frame
from fbvm.step.stepping import Stepping
from fbvm.syntax.ladder.drawing.widths import Annotations
from fbvm.watch.paths import Place, Span, UnknownPlace
from fbvm.watch.values import Value, show, show_time

AROUND = 2
"""Lines of the source that are shown before and behind the current one."""
MOST_CHANGES = 8
WIDEST_RUNG = 100
WIDE = 32
"""Columns of a source line before the state of its contact, ON or off."""


class StopReport:
    """Makes texts about the current position of a session; `texts` are the sources by name."""

    def __init__(self, session: Stepping, texts: Mapping[str, str]) -> None:
        self._session = session
        self._lines = {name: text.split("\n") for name, text in texts.items()}
        self.sites = session.facts.image.sites

    def site(self) -> Site | None:
        """The statement that is executed next, or that a trap has ended."""
        statement = self._session.statement
        if self._session.trap:
            return self._session.trap.site
        return self.sites[statement.site] if statement else None

    def line(self, file: str, number: int) -> str:
        """Line `number` of a source, "" if the source or the line is unknown."""
        rows = self._lines.get(file, [])
        return rows[number - 1].rstrip() if 0 < number <= len(rows) else ""

    def place(self) -> str:
        """The position: `scan 3, 30ms: pump.st:15 in Main.Station`."""
        session, site = self._session, self.site()
        text = f"scan {session.here.scan}, {show_time(session.now_ns)[2:]}: "
        if session.trap:
            return f"{text}{session.trap}"
        if site is None or session.statement is None:
            return f"{text}end of the program; the I/O refresh comes next"
        return f"{text}{short(site)} in {self.instance(session.statement.frame)}"

    def instance(self, frame: Frame) -> str:
        """The path of an instance, with the method or property that is executed; a function has only its name."""
        name = self._session.facts.body_name(frame.body)
        path = self._session.names.instance(frame.base)
        facts = self._session.facts
        return f"{path}.{facts.name_in_block(frame.body)}" if path and facts.is_method(frame.body) else path or name

    def around(self, lines: int = AROUND) -> Iterator[str]:
        """The source around the next statement, whose line is marked with >; `lines` before and behind it."""
        site = self.site()
        if site is None:
            return
        power = self._power(site.file)
        last = max(site.line, min(site.line + lines, len(self._lines.get(site.file, []))))
        for number in range(max(1, site.line - lines), last + 1):
            text = self.line(site.file, number)
            if text or number == site.line:
                said = f"{text:<{WIDE}}  {'ON' if power[number] else 'off'}" if number in power else text
                yield f" {'>' if number == site.line else ' '}{number:>4}  {said}".rstrip()

    def _power(self, file: str) -> dict[int, bool]:
        """By line of a ladder source: whether its element conducted in this scan, in rungs of the current instance."""
        statement = self._session.statement
        return {site.line: seen[-1] for rung in self._session.rungs
                if statement and rung.base == statement.frame.base and not rung.picture.is_text
                for step, seen in rung.states.items()
                if (site := self.sites[rung.picture.steps[step][0]]).file == file}  # fmt: skip

    def rung(self, number: int | None) -> Iterator[str]:
        """The drawing of rung `number` of this POU; without a number of the last and the next rung.  Raises ValueError."""
        statement, image = self._session.statement, self._session.facts.image
        mine = [rung for rung in image.rungs if statement and rung.body == statement.frame.body]
        if not mine or statement is None:
            raise ValueError("there are no rungs here")
        place = self.site()
        before = [rung for rung in mine if place and self.sites[rung.site].line <= place.line] or mine[:1]
        chosen = before[-2:] if number is None else [rung for rung in mine if rung.number == number]
        if not chosen:
            raise ValueError(f"there is no rung {number}; rungs are {mine[0].number} to {mine[-1].number}")
        for rung in chosen:
            seen = [made for made in self._session.rungs if made.picture is rung and made.base == statement.frame.base]
            is_seen = bool(seen and seen[-1].states)
            annotations = Annotations(seen[-1].states, values=self._session.values.of(seen[-1])) if is_seen else Annotations()
            yield from ladder_text(rung, WIDEST_RUNG, annotations)

    def chart(self) -> Iterator[str]:
        """The drawing of the chart of this POU with its active steps.  Raises ValueError if the POU is no chart."""
        statement, image = self._session.statement, self._session.facts.image
        here = image.bodies[statement.frame.body].name if statement else ""
        for chart in image.charts:
            name = image.bodies[chart.body].name
            if statement and here in (name, f"{name}.{here.rpartition('.')[2]}"):
                base = statement.frame.base
                tested = [made.tested for made in self._session.charts if made.picture is chart and made.base == base]
                active = active_steps(chart, base, self._session.player.moment)
                yield from sfc_text(chart, WIDEST_RUNG, ChartState(active, tested[-1] if tested else {}))
                return
        raise ValueError("there is no chart here")

    def changes(self) -> Iterator[str]:
        """The values that the last move changed, a line each."""
        changes = list(self._session.changes())
        for change in changes[:MOST_CHANGES]:
            old, new = (text.removeprefix("-> ") for text in (change.old, change.new))
            yield f"  {change.place.name}: {old} -> {new}"
        if len(changes) > MOST_CHANGES:
            yield f"  and {len(changes) - MOST_CHANGES} more"

    def calls(self) -> Iterator[str]:
        """The call stack, the innermost body first."""
        statement = self._session.statement
        if statement is None:
            return
        frame, site = statement.frame, statement.site
        while frame.caller is not None:
            yield f"  {short(self.sites[site]):<20} {self.instance(frame)} ({self._session.facts.body_name(frame.body)})"
            frame, site = frame.caller, frame.site

    def value(self, text: str) -> str:
        """`Main.Delay.ET = T#20ms`; of words also the hexadecimal value, and the description of a unit's word."""
        try:
            found = self._session.find_here(text)
        except UnknownPlace:
            if made := self._session.property(text):
                return self._one(made.place, made.value)
            raise
        value = self._session.read(found)
        if isinstance(found, Span):
            values = value if isinstance(value, list) else []
            return "\n".join(self._one(place, item) for place, item in zip(found.places, values, strict=True))
        return self._one(found, value)

    def _one(self, place: Place, found: Value) -> str:
        name, value = place.name, self._session.names.name_references(place.type, found)
        if isinstance(base(place.type), StructType) and isinstance(value, dict):
            return f"{name} = {place.type.name} {show(place.type, value)}"
        text = f"{name} = {show(place.type, value)}"
        if place.area and isinstance(value, int) and not isinstance(value, bool):
            text += f" ({show(place.type, value, hexadecimal=True)})"
        if place.area and (said := self._session.facts.described.get(name)):
            text += f"   {said}"
        return text


def short(site: Site) -> str:
    """The file and line of a statement: `pump.st:15`."""
    return f"{site.file.rpartition('/')[2]}:{site.line}"
