"""The requests about breakpoints: lines, functions, data, exceptions.

All that a client sets is kept as it was asked for, so that a restart, or another program, sets it again."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from fbvm.dap.memory import place_of as byte_of
from fbvm.dap.session import Arguments, Body, Container, DebugSession, Refusal
from fbvm.machine.breakpoints import Breakpoint, BreakpointRows
from fbvm.machine.source_lines import find_lines
from fbvm.record.recording.file_scans import FileScans
from fbvm.step.debugger import Debugger
from fbvm.step.filters import BETWEEN, FILTERS, BetweenScans
from fbvm.step.past_session import PastSession
from fbvm.watch.conditions import ConditionError
from fbvm.watch.paths import UnknownPlace
from fbvm.watch.scopes import instances
from fbvm.watch.values import literal


@dataclass(frozen=True)
class Wanted:
    """A breakpoint as the client asked for it: its number, and what it is on each PLC that has it."""

    number: int
    rows: tuple[tuple[str, Breakpoint], ...]


@dataclass
class BreakpointRequests:
    """The breakpoints of a session, by source and by kind."""

    debug: DebugSession
    _groups: dict[str, list[Wanted]] = field(default_factory=dict)
    _filters: dict[str, str] = field(default_factory=dict)
    _next: int = 1

    def apply(self) -> None:
        """Sets all breakpoints on all PLCs."""
        debugger = self.debug.running
        for name, plc in debugger.plcs.items():
            plc.put([row for group in self._groups.values() for wanted in group for plc_name, row in wanted.rows
                     if plc_name == name])  # fmt: skip
        self._apply_filters(debugger)

    def clear(self) -> None:
        """Takes away all breakpoints and filters."""
        self._groups.clear()
        self._filters.clear()
        self.apply()

    def renew(self) -> None:
        """Sets the same breakpoints in another program, as far as it has them, and tells the client which it has not."""
        for group, wanted in self._groups.items():
            kept = []
            for one in wanted:
                rows, reason = self._try((name, row) for name, row in one.rows if name in self.debug.running.plcs)
                kept.append(Wanted(one.number, tuple(rows)))
                if one.rows and not rows:
                    changed = {"id": one.number, "verified": False, "reason": "failed", "message": reason}
                    self.debug.send_event("breakpoint", {"reason": "changed", "breakpoint": changed})
            self._groups[group] = kept
        self.apply()

    def pending(self, asked: int) -> Body:
        """The answer to a request that comes before anything is debugged: so many breakpoints that are not set yet."""
        numbers = range(self._next, self._next + asked)
        self._next += asked
        reason = {"verified": False, "reason": "pending", "message": "the program is not loaded yet"}
        return {"breakpoints": [{"id": number, **reason} for number in numbers]}

    def keep_numbers(self, numbers: Mapping[int, int]) -> None:
        """Gives breakpoints the numbers under which the client knows them already."""
        for group, rows in self._groups.items():
            self._groups[group] = [replace(row, number=numbers.get(row.number, row.number)) for row in rows]

    @property
    def is_empty(self) -> bool:
        """True if none is set."""
        return not any(wanted.rows for group in self._groups.values() for wanted in group)

    def numbers(self, plc: str, reached: Iterable[Breakpoint]) -> list[int]:
        """The client's numbers of breakpoints of a PLC."""
        rows = [(plc, each) for each in reached]
        return [wanted.number for group in self._groups.values() for wanted in group if any(row in wanted.rows for row in rows)]

    def _answer(self, group: str, found: list[tuple[list[tuple[str, Breakpoint]], Body]]) -> Body:
        """Replaces the breakpoints of a group, and tells the client which were set."""
        self._groups[group], answers = [], []
        for rows, answer in found:
            self._groups[group].append(Wanted(self._next, tuple(rows)))
            answers.append({"id": self._next, "verified": bool(rows), **answer})
            self._next += 1
        self.apply()
        return {"breakpoints": answers}

    def _try(self, wanted: Iterable[tuple[str, Breakpoint]]) -> tuple[list[tuple[str, Breakpoint]], str]:
        """The rows that can be set, with the names they have then, and why none can."""
        rows, reason = [], "no PLC has that"
        for name, row in wanted:
            session = self.debug.plc(name)
            try:
                rows.append((name, BreakpointRows(session.player, session.facts.image).put(row)))
            except (ConditionError, UnknownPlace, ValueError, TypeError) as error:
                reason = str(error)
        return rows, reason

    # --- lines --------------------------------------------------------------------------------------------------------

    def set_lines(self, arguments: Arguments) -> Body:
        """setBreakpoints: replaces those of one source."""
        sources, debugger = self.debug.sources, self.debug.running
        source = arguments.get("source") or {}
        name = sources.name_of(source)
        asked = arguments.get("breakpoints")
        if asked is None:
            asked = [{"line": line} for line in arguments.get("lines") or ()]
        if name is None:
            message = "this program has no such source"
            return self._answer(f"source {source.get('path')}", [([], {"message": message, "reason": "failed"}) for _ in asked])
        found = []
        for one in asked:
            line = sources.line(int(one["line"]))
            row = Breakpoint("line", f"{name}:{line}", one.get("condition") or "", one.get("hitCondition") or "",
                             one.get("logMessage") or "")  # fmt: skip
            has_it = [plc for plc in debugger.plcs
                      if any(site.file == name for site in self.debug.plc(plc).facts.sites)]
            rows, reason = self._try((plc, row) for plc in has_it)
            if rows:
                at = int(rows[0][1].where.rpartition(":")[2])
                columns = [place["column"] for place in sources.locations(name, at, at)]
                found.append((rows, {"line": sources.client_line(at), "column": min(columns), "source": sources.source(name)}))
            else:
                found.append((rows, {"message": reason, "reason": "failed", "line": one["line"]}))
        return self._answer(f"source {name}", found)

    def locations(self, arguments: Arguments) -> Body:
        """breakpointLocations: where in some lines breakpoints can be."""
        sources = self.debug.sources
        name = sources.name_of(arguments.get("source") or {})
        first = sources.line(int(arguments.get("line") or 1))
        last = sources.line(int(arguments.get("endLine") or arguments.get("line") or 1))
        return {"breakpoints": sources.locations(name, first, last) if name else []}

    # --- functions ----------------------------------------------------------------------------------------------------

    def set_functions(self, arguments: Arguments) -> Body:
        """setFunctionBreakpoints: POUs, instances (`Main.P1`), rungs (`Main#3`), steps of charts (`Main.Walking`)."""
        debugger, found = self.debug.running, []
        for one in arguments.get("breakpoints") or ():
            name, when, hits = str(one.get("name", "")).strip(), one.get("condition") or "", one.get("hitCondition") or ""
            rows, reason = self._try((plc, self._function(plc, name, when, hits)) for plc in debugger.plcs)
            answer: Body = {} if rows else {"message": reason, "reason": "failed"}
            if rows and rows[0][1].kind == "line":
                plc, row = rows[0]
                lines = find_lines(self.debug.plc(plc).facts.image, row.where)
                site = self.debug.plc(plc).facts.sites[min(lines.sites)]
                answer = {"source": self.debug.sources.source(site.file), **self.debug.sources.place(site)}
            found.append((rows, answer))
        return self._answer("functions", found)

    def _function(self, plc: str, name: str, when: str, hits: str) -> Breakpoint:
        """A step of a chart, or what `BreakpointRows.line` takes."""
        session = self.debug.plc(plc)
        pou, dot, step = name.rpartition(".")
        for chart in session.facts.charts if dot else ():
            if any(row[0].upper() == step.upper() for row in chart.steps):
                kind = session.facts.body_name(chart.body)
                paths = [place.name for place in instances(session.facts.symbols, kind, 100)]
                if pou.upper() in (kind.upper(), *(path.upper() for path in paths)):
                    path = paths[0] if pou.upper() == kind.upper() and paths else pou
                    flag = f"{path}.{step}.X"
                    return Breakpoint("condition", f"{flag} AND ({when})" if when else flag, "", hits)
        return Breakpoint("line", name, when, hits)

    # --- data ---------------------------------------------------------------------------------------------------------

    def data_info(self, arguments: Arguments) -> Body:
        """dataBreakpointInfo: whether a variable, an expression or an address can be watched."""
        name = str(arguments.get("name", ""))
        session, plc = self.debug.plc(), self.debug.running.focus
        try:
            if arguments.get("asAddress"):
                found = session.names.at(byte_of(session, name))
                text = found.name if found else ""
                size = int(arguments.get("bytes") or 0)
                address = session.names.address(found) if found else ""
                if found and address and size > found.type.size:
                    last = session.names.at(found.offset + size - 1)
                    text = f"{address}..{session.names.address(last)}" if last else text
            elif arguments.get("variablesReference"):
                container: Container = self.debug.referred(arguments["variablesReference"], Container)
                text = container.named(name).name
            else:
                text = self.debug.scope(self.debug.frame_of(arguments)).find(name).name
            if not text:
                raise Refusal(f"nothing has a name at {name}")
            BreakpointRows(session.player, session.facts.image).change(text)
        except (Refusal, UnknownPlace, ValueError, TypeError) as error:
            return {"dataId": None, "description": str(error)}
        return {"dataId": f"{plc}|{text}", "description": text, "accessTypes": ["write"], "canPersist": True}

    def set_data(self, arguments: Arguments) -> Body:
        """setDataBreakpoints."""
        found: list[tuple[list[tuple[str, Breakpoint]], Body]] = []
        for one in arguments.get("breakpoints") or ():
            plc, _, text = str(one.get("dataId", "")).rpartition("|")
            row = Breakpoint("change", text, one.get("condition") or "", one.get("hitCondition") or "")
            if one.get("accessType", "write") != "write":
                found.append(([], {"message": "a change can be watched, a read cannot", "reason": "failed"}))
                continue
            known = [plc] if plc in self.debug.running.plcs else list(self.debug.running.plcs)[:1]
            rows, reason = self._try((name, row) for name in known)
            found.append((rows, {} if rows else {"message": reason, "reason": "failed"}))
        return self._answer("data", found)

    # --- exceptions ---------------------------------------------------------------------------------------------------

    def set_exceptions(self, arguments: Arguments) -> Body:
        """setExceptionBreakpoints: which filters are on, in either of the two forms."""
        asked = {str(name): "" for name in arguments.get("filters") or ()}
        asked |= {str(row["filterId"]): row.get("condition") or "" for row in arguments.get("filterOptions") or ()}
        known = {row.name for row in FILTERS}
        answers: list[Body] = []
        self._filters = {}
        for name, condition in asked.items():
            try:
                if name not in known:
                    raise ValueError(f"there is no filter {name!r}; there are {', '.join(sorted(known))}")
                _codes(condition)
            except ValueError as error:
                answers.append({"verified": False, "message": str(error)})
                continue
            self._filters[name] = condition
            answers.append({"verified": True})
        self._apply_filters(self.debug.running)
        return {"breakpoints": answers}

    def is_on(self, name: str) -> bool:
        """True if an exception filter is on."""
        return name in self._filters

    def _apply_filters(self, debugger: Debugger) -> None:
        wanted: dict[str, frozenset[int]] = {name: _codes(self._filters[name]) for name in BETWEEN if name in self._filters}
        debugger.checks = {}
        for name in debugger.plcs:
            session = self.debug.plc(name)
            source = session.source if isinstance(session, PastSession) else None
            differs = source.begins_to_differ if isinstance(source, FileScans) and source.may_differ else None
            never = {key for key, can in (("response", session.facts.described), ("differs", differs)) if not can}
            if wanted.keys() - never:
                debugger.checks[name] = BetweenScans(wanted, differs)


def _codes(condition: str) -> frozenset[int]:
    """The codes that a condition names: `2`, `16#0302`, `code = 2`; none for "".  Raises ValueError."""
    text = condition.strip()
    if not text:
        return frozenset()
    found = set()
    for part in text.lower().removeprefix("code").strip().removeprefix("=").split(","):
        value, _ = literal(part.strip())
        if not isinstance(value, int) or isinstance(value, bool):
            raise ValueError(f"{condition!r} is no code; write 2, or 16#0302")
        found.add(value)
    return frozenset(found)
