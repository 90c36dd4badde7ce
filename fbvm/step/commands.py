"""The commands of `fbvm step`: a word and its argument.  `help` lists them; an empty line repeats the last move.

    run Main.Delay.Q          back scan        force CIO 0.00 = TRUE          print Main.Delay D200..D209
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import partial

from fbvm.base.digits import whole_number
from fbvm.base.types import StructType, fold
from fbvm.machine.breakpoints import Breakpoint as Row
from fbvm.machine.plc import Mode, Plc
from fbvm.record.draw.table import ScanTable
from fbvm.record.draw.why import cause_text, why
from fbvm.record.trace.packets import Packet
from fbvm.record.trace.recorder import signals_at
from fbvm.step.breakpoints import Breakpoint, Reached, Watched, any_reached, parse_breakpoint, parse_row
from fbvm.step.debugger import Debugger, Move
from fbvm.step.past_session import PastSession
from fbvm.step.position import Reached as Where
from fbvm.step.scan_replay import Action
from fbvm.step.session import Session
from fbvm.step.session_events import SessionEvents
from fbvm.step.stepping import Stepping
from fbvm.step.stop_report import StopReport
from fbvm.watch.conditions import ConditionError, parse_condition, split_condition
from fbvm.watch.names import is_single
from fbvm.watch.paths import Place, Span, UnknownPlace
from fbvm.watch.places import parse_for
from fbvm.watch.scanner import listed_places
from fbvm.watch.values import parse_time_ns

LOOK_AHEAD_NS = 60_000_000_000
"""How far `run` executes to find a line or a condition."""
TABLE_SCANS = 5


class CommandError(Exception):
    """A line is no command, or the command cannot be executed here; the message says why."""


class ExpectationError(CommandError):
    """The condition of `expect` does not hold."""


@dataclass(frozen=True)
class Command:
    """A command: its name and short form, its syntax and help; `moves` if it changes the position."""

    name: str
    short: str
    usage: str
    help: str
    moves: bool = False
    takes: str = ""
    """What its argument is completed with: "place", "line", "command" or nothing."""


COMMANDS = (
    Command("step", "s", "step [N]", "one statement on, into blocks", True),
    Command("next", "n", "next [N]", "one statement on, blocks at once", True),
    Command("out", "o", "out", "to the end of this block", True),
    Command("scan", "c", "scan [N]", "to the beginning of the next scan, or the Nth from here", True),
    Command("run", "r", "run [LINE | CONDITION | TIME]", "to a breakpoint, for a time at most; or to a line or condition",
            True, "place"),
    Command("back", "b", "back [N | scan | run | FILE:LINE | CONDITION]",
            "one statement back, to the scan's beginning, to the last breakpoint, or to where it last was so", True, "place"),
    Command("goto", "g", "goto SCAN", "to the beginning of any scan", True),
    Command("break", "k", "break [LINE | CONDITION | NAME]", "a breakpoint for `run`, NAME: where it changes; or lists them",
            takes="line"),
    Command("unbreak", "", "unbreak [NUMBER]", "takes a breakpoint away, or all"),
    Command("print", "p", "print NAME...", "values of variables, blocks, addresses, ranges", takes="place"),
    Command("watch", "w", "watch NAME... [IF CONDITION]", "prints these at each stop, or where that holds", takes="place"),
    Command("unwatch", "", "unwatch [NAME...]", "no longer", takes="place"),
    Command("write", "", "write NAME = VALUE", "writes once, here; what came later is forgotten", takes="place"),
    Command("force", "f", "force NAME = VALUE", "holds a value from here on", takes="place"),
    Command("unforce", "", "unforce [NAME]", "ends a force, or all", takes="place"),
    Command("mode", "", "mode PROGRAM | RUN", "changes the mode between two scans"),
    Command("power", "", "power [cold]", "power off and on between two scans; cold forgets what is retained"),
    Command("table", "t", "table [NAME...]", "the scan table of the last scans, of what is named or watched", takes="place"),
    Command("why", "y", "why NAME", "why it has its value", takes="place"),
    Command("list", "l", "list [LINES]", "the text around"),
    Command("rung", "u", "rung [NUMBER]", "the rungs executed last and next, with their power, or one of this POU"),
    Command("sfc", "", "sfc", "the chart of this POU, with its active steps and tested transitions"),
    Command("calls", "", "calls", "who called whom"),
    Command("net", "", "net [SCANS]", "what passed the network in the scan before, or in the last ones"),
    Command("expect", "", "expect CONDITION", "fails if it does not hold; for scripts", takes="place"),
    Command("help", "h", "help [COMMAND]", "this list, or one of its lines", takes="command"),
    Command("quit", "q", "quit", "ends the session"),
)  # fmt: skip
COMMANDS_BY_WORD = {word: command for command in COMMANDS for word in (command.name, command.short) if word}


_OPERATOR = re.compile(r"\s*(?::=|=|(?:[<>*/&]|[+-]\s|(?:AND|OR|XOR|MOD)\b)\s*\S)", re.IGNORECASE)
"""What stands behind the first operand of an assignment or expression, and begins no argument of a command."""


def command_of(line: str) -> Command | None:
    """The command that a line begins with; None without one, and for an assignment or an expression, whose variable may be
    called as a command is."""
    name, _, rest = line.partition(" ")
    return None if _OPERATOR.match(rest) else COMMANDS_BY_WORD.get(name.lower())


class Commands:
    """Executes command lines on a session.

    `report` makes the texts, `packets` returns the packets of the network so far.  `ended` is True after `quit`."""

    def __init__(self, session: Session | PastSession, report: StopReport, packets: Callable[[], list[Packet]] = list) -> None:
        self.session, self.report = session, report
        self.debugger = Debugger({session.name: session})
        self.watches: list[Watched] = []
        self.breakpoints: list[Row] = []
        self.ended = False
        self._packets = packets
        self._last = "step"

    def run(self, line: str) -> Iterator[str]:
        """Executes a line and yields the lines that it prints.  Raises CommandError."""
        line = line.strip()
        if line.startswith("//"):
            return
        name, _, rest = (line or self._last).partition(" ")
        command = command_of(line or self._last)
        rest = rest.strip()
        if command is None and re.search(r":=|(?<![<>])=", line):
            command, rest = COMMANDS_BY_WORD["write"], line
        if command is None and name.lower() in COMMANDS_BY_WORD:
            raise CommandError(f"{line} is an expression: `expect` says whether a condition holds, `print` shows variables")
        if command is None:
            raise CommandError(f"{name!r} is no command{_near(name) or '; `help` lists them'}")
        if command.moves:
            self._last = line or self._last
            self.session.mark()
        function: Callable[[str], Iterator[str] | None] = getattr(self, f"_{command.name}")
        try:
            lines = function(rest)
            yield from lines or ()
        except (ConditionError, UnknownPlace, ValueError, TypeError) as error:
            raise CommandError(str(error)) from None
        if command.moves:
            yield from self.stop()

    def stop(self) -> Iterator[str]:
        """The lines that are printed at each stop: position, source, changed values, watched values."""
        yield self.report.place()
        yield from self.report.around()
        yield from self.report.changes()
        for watched in self.watches:
            if watched.condition is None or watched.condition.holds(self.session.read):
                yield self.report.value(watched.name)

    # --- moves

    def _step(self, rest: str) -> None:
        for _ in range(_count(rest)):
            self.session.step()

    def _next(self, rest: str) -> None:
        for _ in range(_count(rest)):
            self.session.step_over()

    def _out(self, rest: str) -> None:
        self.session.step_out()

    def _scan(self, rest: str) -> None:
        self.session.scan(_count(rest))

    def _goto(self, rest: str) -> None:
        self.session.goto(_count(rest, least=0))

    def _run(self, rest: str) -> Iterator[str]:
        cycle_ns = self.session.facts.cycle_ns
        scans = max(1, LOOK_AHEAD_NS // cycle_ns)
        is_time = re.fullmatch(r"(?:T#)?[\d.]+\s*[a-zA-Z]\w*", rest, re.I)
        if is_time or not rest:
            if is_time:
                scans = max(1, -(-parse_time_ns(rest) // cycle_ns))
            elif not self.breakpoints:
                raise CommandError("say where to: a line, a condition or a time; or set breakpoints")
            reached = self._moved(self.debugger.resume(self.session.here.scan + scans))
            if reached and reached.breakpoints:
                yield from reached.reasons
            elif not is_time and not self.session.trap:
                yield f"no breakpoint was reached in {scans} scans"
            return
        stop: Reached = partial(any_reached, [self._target(rest)])
        if not self.session.run(stop, scans) and not self.session.trap:
            yield f"{rest} was not reached in {scans} scans"

    def _back(self, rest: str) -> Iterator[str]:
        if rest.lower() == "scan":
            self.session.back_scan()
        elif not rest or rest.isdecimal():
            for _ in range(_count(rest)):
                self.session.back()
        else:
            if rest.lower() == "run":
                if not self.breakpoints:
                    raise CommandError("set breakpoints first, or say where to: a line or a condition")
                reached = self._moved(self.debugger.reverse())
                yield from reached.reasons if reached else ("no breakpoint was reached before",)
            elif not self.session.run_back(partial(any_reached, [self._target(rest)])):
                yield f"{rest} was never reached before"

    def _moved(self, move: Move) -> Where | None:
        """Carries out a whole move of the debugger; returns what stopped it."""
        self.debugger.here.put(self.breakpoints)
        while True:
            try:
                next(move)
            except StopIteration as end:
                reached: Where | None = end.value
                return reached

    def _target(self, text: str) -> Breakpoint:
        return parse_breakpoint(text, self.session, self.report.site())

    # --- breakpoints

    def _break(self, rest: str) -> Iterator[str]:
        if rest:
            self.breakpoints.append(parse_row(rest, self.session, self.report.site()))
        for number, each in enumerate(self.breakpoints, 1):
            changes = "change of " if each.kind == "change" else ""
            yield (f"  {number}  {changes}{each.where}" + (f" IF {each.when}" if each.when else "")
                   + (f" HITS {each.hits}" if each.hits else ""))

    def _unbreak(self, rest: str) -> None:
        if not rest:
            self.breakpoints.clear()
            return
        number = _count(rest)
        if number > len(self.breakpoints):
            raise CommandError(f"there is no breakpoint {number}")
        del self.breakpoints[number - 1]

    # --- values

    def _print(self, rest: str) -> Iterator[str]:
        for name in self._names(rest):
            yield self.report.value(name)

    def _watch(self, rest: str) -> Iterator[str]:
        where, when = split_condition(rest)
        names = self._names(where)
        condition = parse_condition(when, self.session.find) if when else None
        for name in names:
            yield self.report.value(name)
        self._unwatch(where)
        self.watches += [Watched(name, condition) for name in names]

    def _unwatch(self, rest: str) -> None:
        gone = [fold(name) for name in self._names(rest)] if rest else None
        self.watches = [each for each in self.watches if gone is not None and fold(each.name) not in gone]

    def _write(self, rest: str) -> Iterator[str]:
        place, value = self._value(rest)
        yield from self._act(lambda plc: plc.write(place, value), place.name)

    def _force(self, rest: str) -> Iterator[str]:
        place, value = self._value(rest)
        if not isinstance(place, Place):
            raise CommandError("force one place after the other")
        yield from self._act(lambda plc: plc.force(place.name, value), place.name)

    def _unforce(self, rest: str) -> None:
        name = _place(self.session, rest).name if rest else None
        self.session.act(lambda plc: plc.unforce(name))

    def _value(self, rest: str) -> tuple[Place | Span, object]:
        match = re.fullmatch(r"(.+?)\s*:?=\s*(.+)", rest)
        if not match:
            raise CommandError("write NAME = VALUE")
        found = self.session.find_here(match[1])
        return found, parse_for(found, match[2])

    def _act(self, action: Action, name: str) -> Iterator[str]:
        self.session.act(action)
        yield self.report.value(name)

    def _mode(self, rest: str) -> None:
        self._between()
        mode = Mode(rest.upper()) if rest.upper() in Mode.__members__ else None
        if mode is None:
            raise CommandError("mode PROGRAM, or mode RUN")
        self.session.act(partial(_set_mode, mode))

    def _power(self, rest: str) -> None:
        self._between()
        if rest.lower() not in ("", "cold"):
            raise CommandError("power, or power cold")
        self.session.act(Plc.cold_start if rest else Plc.warm_start)

    def _between(self) -> None:
        if self.session.here.step:
            raise CommandError("that can be done between two scans only; `scan` or `back scan` goes there")

    # --- looking

    def _table(self, rest: str) -> Iterator[str]:
        names = self._names(rest) if rest else [each.name for each in self.watches]
        if not names:
            raise CommandError("name variables, or watch some")
        signals = [signal for name in names for signal in signals_at(self.session.find(name), {})]
        table = ScanTable(self.report.sites, self.session.names, signals)
        here = self.session.here.scan
        self.session.follow(table, range(here - TABLE_SCANS + 1, here + 1))
        yield table.draw()

    def _why(self, rest: str) -> Iterator[str]:
        past = SessionEvents(self.session, self.report)
        yield cause_text(past, why(past, _place(self.session, rest), self.session.here.scan))

    def _list(self, rest: str) -> Iterator[str]:
        return self.report.around(_count(rest) if rest else 10)

    def _rung(self, rest: str) -> Iterator[str]:
        return self.report.rung(_count(rest, least=0) if rest else None)

    def _sfc(self, rest: str) -> Iterator[str]:
        return self.report.chart()

    def _calls(self, rest: str) -> Iterator[str]:
        return self.report.calls()

    def _net(self, rest: str) -> Iterator[str]:
        end_ns, cycle_ns = self.session.now_ns, self.session.facts.cycle_ns
        start_ns = end_ns - _count(rest) * cycle_ns
        for row in self._packets():
            if start_ns <= row.now_ns < end_ns:
                yield f"  {row}"

    def _expect(self, rest: str) -> None:
        condition = parse_condition(rest, self.session.find)
        if not condition.holds(self.session.read):
            raise ExpectationError(f"{rest} does not hold in {self.report.place()}")

    def _help(self, rest: str) -> Iterator[str]:
        asked = COMMANDS_BY_WORD.get(rest.lower())
        if rest and not asked:
            raise CommandError(f"{rest!r} is no command{_near(rest)}")
        for command in COMMANDS:
            if asked in (None, command):
                short = f"{command.short:<2}" if command.short else "  "
                yield f"  {short} {command.usage:<32} {command.help}"
        if not rest:
            yield "  LINE is 15, pump.st:15, a POU, a rung (Main#3), an instance or its method, alone or before IF CONDITION."
            yield "  Behind HITS 5 or HITS % 5 a breakpoint says at which passes it stops.  NAME is a variable, an address or"
            yield "  a range, D200..D209.  NAME := VALUE writes, too.  An empty line moves again."

    def _quit(self, rest: str) -> None:
        self.ended = True

    @staticmethod
    def _names(rest: str) -> list[str]:
        """The names in an argument, separated by blanks or commas; `CIO 0.00` is one name."""
        parts = listed_places(rest)
        if not parts:
            raise CommandError("name something")
        return parts

    def completions(self, text: str) -> list[str]:
        """Completions of the last word of a line."""
        name, blank, rest = text.lstrip().partition(" ")
        if not blank:
            return [command.name for command in COMMANDS if command.name.startswith(name.lower())]
        takes = COMMANDS_BY_WORD[name.lower()].takes if name.lower() in COMMANDS_BY_WORD else "place"
        return completed(self.session, takes, re.split(r"[\s,(]", rest)[-1], list(COMMANDS_BY_WORD))


def completed(session: Stepping, takes: str, word: str, words: Mapping[str, object] | list[str]) -> list[str]:
    """Completions of a word: paths of the program, or for `help` names of commands."""
    if takes == "command":
        return [each for each in words if each.startswith(word.lower())]
    if takes not in ("place", "line"):
        return []
    front, dot, last = word.rpartition(".")
    if dot:
        try:
            place = session.find(front)
        except UnknownPlace:
            return []
        kind = getattr(place, "type", None)
        names = [field.name for field in getattr(kind, "fields", {}).values()]
        names += session.properties.of(kind) if isinstance(kind, StructType) else []
    else:
        names = [field.name for field in session.facts.image.symbols.values()]
    return [f"{front}{dot}{name}" for name in names if fold(name).startswith(fold(last))]


def _near(word: str) -> str:
    """`; did you mean break?` for a misspelt command, "" if none is spelt alike."""
    near = get_close_matches(word.lower(), [command.name for command in COMMANDS], 1)
    return f"; did you mean {near[0]}?" if near else ""


def _count(text: str, least: int = 1) -> int:
    if not text:
        return 1
    if not text.isdecimal() or whole_number(text) < least:
        raise CommandError(f"{text!r} is no number of steps")
    return whole_number(text)


def _place(session: Stepping, text: str) -> Place:
    try:
        found = session.find_here(text) if text else None
    except UnknownPlace:
        if session.property(text):
            raise CommandError(f"{text} is a property, which is computed when it is read; name a variable") from None
        raise
    if not isinstance(found, Place) or not is_single(found):
        raise CommandError("name one variable, not a block, an array or a range" if found else "name something")
    return found


def _set_mode(mode: Mode, plc: Plc) -> None:
    plc.mode = mode
