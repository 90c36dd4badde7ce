"""The PLCs of a run and all that can be done to them from a page.  Every change is kept as an act, with who and when."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from fbvm.engine.trap import Trap
from fbvm.live.changes import SourceChanges
from fbvm.live.groups import WatchGroups
from fbvm.live.lesson import LiveLesson
from fbvm.live.messages import MessageError
from fbvm.live.pictures import Pictures
from fbvm.live.plcs import LivePlc
from fbvm.live.stops import set_breakpoint, shown_breakpoints, stop_at_next_statement
from fbvm.machine.plc import Mode
from fbvm.net.faults import KINDS, NAMED, Fault, fault
from fbvm.run.interactive import Control
from fbvm.watch.paths import Place, Span, UnknownPlace
from fbvm.watch.places import parse_for
from fbvm.watch.values import parse_time_ns, show
from fbvm.wire.link import Peer

MOST_STEPS = 100_000
SLOWEST, FASTEST = 0.001, 1000.0
"""Bounds of the speed of virtual time; 0 is as fast as it goes."""
PERCENT = {"lose_percent": "percent", "duplicate_percent": "percent"}
MEASURES = {name: PERCENT.get(kind.needed[0], "time") for name, kind in NAMED.items()
            if kind.needed and kind.needed[0].endswith(("_percent", "_ns"))}  # fmt: skip
"""What says how much of a fault there is: the field of its message."""
REFUSED = (UnknownPlace, ValueError, TypeError)
"""What an action raises whose names or values do not fit the program."""


@dataclass(frozen=True)
class Act:
    """Something that was done from a page: to which PLC, before which of its scans, and as a sentence."""

    plc: str
    scan: int
    now_ns: int
    what: str
    """The action's name in `messages.ACTIONS`."""
    text: str
    name: str = ""
    """The variable, if it is about one."""
    value: object = None
    """As `Plc.write` takes it."""


@dataclass(frozen=True)
class Order:
    """An action as it was asked for, and how many scans each PLC had done."""

    action: str
    fields: dict[str, Any]
    scans: dict[str, int]


class Workbench:
    """All PLCs of a run, their `control`, and the faults of their networks.

    With `read_only` nothing can be changed; with `writable` only values of these names, and of what is inside them.
    What is written, forced and set is an input of the PLCs' recordings, as what faults let a network tell is."""

    def __init__(self, plcs: Sequence[LivePlc], control: Control, *, read_only: bool = False,
                 writable: Collection[str] | None = None,
                 test: Callable[[Sequence[Act], LivePlc, Sequence[tuple[LivePlc, str]]], str] | None = None,
                 changes: SourceChanges | None = None, pictures: Pictures | None = None) -> None:  # fmt: skip
        self.plcs = {plc.name: plc for plc in plcs}
        self.control, self.read_only = control, read_only
        self.held_by = ""
        """Who has the PLCs instead of the pages, which only look meanwhile; "" if nobody does."""
        self.writable = None if writable is None else [self._checked(name) for name in writable]
        self.make_test = test
        """Writes the acts as a pytest; None where a run cannot be repeated by one."""
        self.pictures = pictures
        """Drawings of the machine; None without a project."""
        self.changes = changes
        """What has become of the sources meanwhile; None where nobody can begin a changed program."""
        self.wants_restart = False
        """True if the run is to end, and the changed program to begin."""
        self.branch_at: tuple[str, int] | None = None
        """The PLC and the number of scans from which another future is to begin."""
        self.groups: WatchGroups | None = None
        """Groups of names that are kept beside the sources; None where there is no place for them."""
        self.can_branch = False
        """True if new PLCs can do the past again: in virtual time, from power-on."""
        self.futures: Sequence[Any] = ()
        """What the PLCs did before another future was begun (`futures.Future`)."""
        self.lesson: LiveLesson | None = None
        """What the page teaches; None for a page that only shows."""
        self.orders: list[Order] = []
        self._to_let_go: list[tuple[str, str, int]] = []
        """What pages that have gone held: PLC, variable, and the number of the scan that sees it first."""
        self.acts: list[Act] = []
        networks: dict[int, Any] = {id(unit.network): unit.network for live in plcs for unit in live.plc.units}
        self.networks = list(networks.values())

    def _checked(self, name: str) -> str:
        """The name of a place as PLCs know it.  Raises UnknownPlace if no PLC has it."""
        *others, last = self.plcs.values()
        for live in others:
            with suppress(UnknownPlace):
                return live.plc.find(name).name
        return last.plc.find(name).name

    def plc(self, name: str) -> LivePlc:
        """The PLC of that name.  Raises MessageError."""
        if name not in self.plcs:
            raise MessageError(f"there is no PLC {name[:40]!r}; there are {', '.join(list(self.plcs)[:8])}")
        return self.plcs[name]

    # --- values -------------------------------------------------------------------------------------------------------

    def write(self, plc: str, name: str, value: str) -> str:
        """Writes a value once, before the next scan; returns it as it is read now."""
        live = self.plc(plc)
        found = self._to_change(live, name)
        given = parse_for(found, value)
        live.plc.write(found, given)
        self._note(live, "inside" if live.plc.halted else "write", f"{found.name} := {_text(found, given)}", found.name, given)
        return _text(found, live.plc.read(found))

    def let_go_later(self, plc: str, name: str, scan: int) -> None:
        """Lets `let_go` end what was held TRUE by a page that has gone, as soon as this scan has seen it."""
        self._to_let_go.append((plc, name, scan))

    def let_go(self) -> None:
        """Writes FALSE to what nobody holds any more; called between scans.  Whoever has the PLCs in place of the pages changes
        them alone."""
        if not self._to_let_go or self.held_by:
            return
        seen = [row for row in self._to_let_go if self.plcs[row[0]].plc.scans > row[2]]
        self._to_let_go = [row for row in self._to_let_go if row not in seen]
        for plc, name, _ in seen:
            fields = {"plc": plc, "name": name, "value": "FALSE"}
            order = self.order("write", fields)
            self.write(**fields)
            self.orders.append(order)

    def force(self, plc: str, name: str, value: str) -> None:
        """Holds a value before and behind the program until it is released."""
        live = self.plc(plc)
        found = self._to_change(live, name)
        if isinstance(found, Span):
            raise MessageError(f"{found.name} is a range; force its places one by one")
        given = parse_for(found, value)
        live.plc.force(found.name, given)
        self._note(live, "force", f"{found.name} forced to {_text(found, given)}", found.name, given)

    def release(self, plc: str, name: str | None = None) -> None:
        """Ends a force, or all of a PLC."""
        live = self.plc(plc)
        if name is None:
            if self.writable is not None:
                raise MessageError("with --allow-write forces are released one by one")
            live.plc.unforce()
            self._note(live, "release", "all forces released")
            return
        found = self._to_change(live, name)
        live.plc.unforce(found.name)
        self._note(live, "release", f"{found.name} released", found.name)

    def _to_change(self, live: LivePlc, name: str) -> Place | Span:
        """The place that a page wants to change.  Raises MessageError if it may not."""
        found = live.plc.find(name)
        if self.writable is not None:
            places = found.places if isinstance(found, Span) else (found,)
            for place in places:
                inside = () if place.hops else self.writable  # what a reference points to may be anywhere
                heads = tuple(f"{name}{mark}" for name in inside for mark in ".[")
                if place.name not in self.writable and not place.name.startswith(heads):
                    raise MessageError(f"{place.name} may not be written: --allow-write names {', '.join(self.writable)}")
        return found

    # --- the scan -----------------------------------------------------------------------------------------------------

    def pause(self) -> None:
        self.control.pause()

    def go_on(self) -> None:
        self.control.go_on()

    def step(self, scans: int) -> None:
        """Executes so many scans of each PLC and pauses."""
        if not 1 <= scans <= MOST_STEPS:
            raise MessageError(f"a step has 1 to {MOST_STEPS:,} scans, not {scans}")
        self.control.step(scans)

    def step_statement(self, plc: str) -> None:
        """Executes one statement of a PLC, and stands before the next one."""
        live = self._to_control(plc)
        if live.is_real:
            raise MessageError("with real connections time does not stand still inside a scan: step whole scans")
        stop_at_next_statement(live)
        self.control.go_on()

    def set_breakpoint(self, plc: str, kind: str, where: str, when: str = "", hits: str = "") -> None:
        """Lets scans of a PLC stand at a line, behind a change, or where a condition holds."""
        live = self._to_control(plc)
        found = set_breakpoint(live, kind, where, when, hits)
        self._note(live, "break", f"breakpoint at {found.kind} {found}")

    def remove_breakpoint(self, plc: str, number: int | None = None) -> None:
        """Removes the breakpoint with this number, or all."""
        live = self._to_control(plc)
        rows = shown_breakpoints(live)
        if number is not None and not 0 <= number < len(rows):
            raise MessageError(f"there is no breakpoint {number}")
        for row in rows if number is None else [rows[number]]:
            live.plc.breakpoints.remove(row)
        self._note(live, "break", "all breakpoints removed" if number is None else f"breakpoint {rows[number]} removed")

    def speed(self, factor: float) -> None:
        """Sets how fast virtual time passes."""
        if any(live.is_real for live in self.plcs.values()):
            raise MessageError("with real connections time passes as it does")
        if factor != 0 and not SLOWEST <= factor <= FASTEST:
            raise MessageError(f"a speed is 0, as fast as it goes, or {SLOWEST} to {FASTEST:g}")
        self.control.speed = float(factor)

    def set_mode(self, plc: str, mode: str) -> None:
        """PROGRAM or RUN."""
        live = self._to_control(plc)
        try:
            live.plc.mode = Mode(mode)
        except ValueError:
            raise MessageError(f"a mode is {' or '.join(one.value for one in Mode)}, not {mode[:20]!r}") from None
        self._note(live, "mode", f"mode {mode}", value=mode)

    def start(self, plc: str, kind: str) -> None:
        """Power off and on, "warm" or "cold"."""
        live = self._to_control(plc)
        if kind not in ("warm", "cold"):
            raise MessageError(f"a start is warm or cold, not {kind[:20]!r}")
        if live.plc.halted:
            raise MessageError("the scan stands at a breakpoint: let it go on first")
        live.plc.warm_start() if kind == "warm" else live.plc.cold_start()
        self._note(live, "start", f"{kind} start", value=kind)

    def restart(self) -> None:
        """Ends the run, so that the changed program begins with what is retained."""
        if self.writable is not None:
            raise MessageError("with --allow-write only values can be changed")
        if self.changes is None or self.changes.state is None:
            raise MessageError("the program has not changed")
        if not self.changes.compile():
            raise MessageError("the changed program cannot run yet: it is checked, or it has errors")
        self.wants_restart = True
        self.control.end()

    def branch(self, plc: str, scans: int) -> None:
        """Ends the run, so that another future begins behind so many scans of a PLC."""
        if self.writable is not None:
            raise MessageError("with --allow-write only values can be changed")
        if not self.can_branch:
            raise MessageError("the past of these PLCs cannot be done again: connections are real, or the program has changed")
        self.branch_at = plc, scans
        self.control.end()

    def keep_group(self, name: str, names: Sequence[str]) -> None:
        """Keeps names to be watched under the name of a group; without names the group is removed."""
        if self.writable is not None:
            raise MessageError("with --allow-write only values can be changed")
        if self.groups is None:
            raise MessageError("this run has no file beside which groups can be kept")
        self.groups.keep(name, names)

    def order(self, action: str, fields: dict[str, Any]) -> Order:
        """An action that is done now, with the number of scans that each PLC has done.  Who holds a value is left out: the end of
        holding it is an action of its own."""
        kept = {name: value for name, value in fields.items() if name != "held"}
        return Order(action, kept, {name: live.plc.scans for name, live in self.plcs.items()})

    def do(self, action: str, fields: Mapping[str, Any]) -> None:
        """Does again what an order says."""
        names: dict[str, Callable[..., object]] = {
            "write": self.write, "force": self.force, "release": self.release, "mode": self.set_mode, "start": self.start,
            "cable": self.cable, "fault": self.add_fault, "mend": self.mend,
        }  # fmt: skip
        names[action](**fields)

    def note_restart(self, old: Workbench, kept: Mapping[str, Sequence[Place]], ended: Mapping[str, Trap | None]) -> None:
        """Notes what the PLCs of this workbench have kept of those before them, as values that were written, and the traps that
        ended FB_exit of these."""
        files = ", ".join(old.changes.state["files"]) if old.changes and old.changes.state else ""
        for name, places in kept.items():
            live = self.plcs[name]
            self._note(live, "restart", f"restart with the changed {files}; {len(places)} retained variables kept their values")
            if (trap := ended.get(name)) is not None:
                self._note(live, "restart", f"FB_exit of the program before ended with {trap}")
            for place in places:
                self.acts.append(Act(live.name, 0, 0, "keep", f"{place.name} kept", place.name, live.plc.read(place)))

    def _to_control(self, plc: str) -> LivePlc:
        if self.writable is not None:
            raise MessageError("with --allow-write only values can be changed")
        return self.plc(plc)

    # --- units and network --------------------------------------------------------------------------------------------

    def cable(self, plc: str, unit: str, plugged: bool) -> None:
        """Pulls or plugs the cable of a unit: its status word says so, and nothing passes."""
        live = self._to_control(plc)
        found = next((attached for attached in live.plc.units if attached.unit.name == unit), None)
        if found is None:
            raise MessageError(f"there is no unit {unit[:40]!r} in {plc}")
        row = Fault(Peer(found.unit.address, 0), silent=True)
        rows = found.network.faults  # type: ignore[attr-defined]
        if plugged:
            rows[:] = [fault for fault in rows if fault != row]
        elif row not in rows:
            rows.insert(0, row)
        settings = found.unit.settings
        if "link_up" in settings:
            found.unit.settings = {**settings, "link_up": plugged}
        text = f"cable of {unit} {'plugged' if plugged else 'pulled'}"
        self._note(live, "cable", text, unit, plugged)

    def is_plugged(self, attached: Any) -> bool:
        """False if somebody has pulled the cable of a unit."""
        return Fault(Peer(attached.unit.address, 0), silent=True) not in attached.network.faults

    @property
    def faults(self) -> list[Fault]:
        """The faults of all networks."""
        return [row for network in self.networks for row in network.faults]

    def add_fault(self, kind: str, peer: str | None = None, percent: int | None = None, time: str | None = None) -> None:
        """Switches a fault on, for one peer or for all."""
        self._check_free()
        if kind not in KINDS:
            raise MessageError(f"there is no fault {kind[:20]!r}; there are {', '.join(NAMED)}")
        fields: dict[str, Any] = {}
        if peer:
            fields["peer"] = _peer(peer)
        for name in NAMED[kind].needed:
            fields[name] = parse_time_ns(time or "100ms") if name.endswith("_ns") else 16
            if fields[name] <= 0:
                raise MessageError(f"{time} is not a time that can pass")
        if percent is not None:
            if not 0 <= percent <= 100:
                raise MessageError(f"{percent} is not 0 to 100 percent")
            fields |= {"lossy": {"lose_percent": percent}, "doubled": {"duplicate_percent": percent}}.get(kind, {})
        row = fault(kind, **fields)
        for network in self.networks:
            network.faults.append(row)
        self._note_all("fault", f"fault {kind}" + (f" at {peer}" if peer else ""), row)

    def mend(self, number: int | None = None) -> None:
        """Ends the fault with that number in `faults`, or all."""
        self._check_free()
        rows = self.faults
        if number is not None and not 0 <= number < len(rows):
            raise MessageError(f"there is no fault {number}")
        for network in self.networks:
            network.faults[:] = [] if number is None else [row for row in network.faults if row is not rows[number]]
        name = "" if number is None else f" {_named(rows[number])}".replace(" fault", "")
        self._note_all("mend", "all faults ended" if number is None else f"fault{name} ended", number)

    def _check_free(self) -> None:
        if self.writable is not None:
            raise MessageError("with --allow-write only values can be changed")
        if not self.networks:
            raise MessageError("this program has no network")

    # --- acts ---------------------------------------------------------------------------------------------------------

    def _note(self, live: LivePlc, what: str, text: str, name: str = "", value: object = None) -> None:
        self.acts.append(Act(live.name, live.plc.scans, live.plc.now_ns, what, text, name, value))

    def _note_all(self, what: str, text: str, value: object = None) -> None:
        for live in self.plcs.values():
            self._note(live, what, text, value=value)


def _text(found: Place | Span, value: object) -> str:
    if isinstance(found, Span):
        return ", ".join(show(place.type, one) for place, one in zip(found.places, value, strict=True))  # type: ignore[call-overload]
    return show(found.type, value)  # type: ignore[arg-type]


def _peer(text: str) -> Peer:
    """`192.168.250.1:502`, or an address alone for all its ports.  Raises MessageError."""
    host, _, port = text.partition(":")
    parts = host.split(".")
    if len(parts) != 4 or not all(part.isascii() and part.isdecimal() and len(part) < 4 and int(part) < 256 for part in parts):
        raise MessageError(f"{text[:40]!r} is no IPv4 address with a port, such as 192.168.250.1:502")
    if port and not (port.isascii() and port.isdecimal() and len(port) < 6 and int(port) < 65536):
        raise MessageError(f"{port[:20]!r} is no port")
    return Peer(host, int(port or 0))


def _named(row: Fault) -> str:
    """The name of a fault's kind as it is known, without its peer and times."""
    for name, kind in KINDS.items():
        fields = [field for field in ("silent", "error", "reset", "random_cut", "segment_bytes") if getattr(kind, field)]
        marks = [field for field in ("latency_ns", "jitter_ns", "join_ns", "lose_percent", "duplicate_percent",
                                     "reset_after_bytes") if getattr(kind, field)]  # fmt: skip
        same = all(getattr(row, field) == getattr(kind, field) for field in ("silent", "error", "reset", "random_cut",
                                                                              "segment_bytes"))  # fmt: skip
        if same and all(getattr(row, field) for field in marks) and (fields or marks):
            return name
    return "fault"


def fault_rows(rows: Sequence[Fault]) -> list[dict[str, Any]]:
    """The faults as the page lists them."""
    return [{"kind": _named(row), "peer": "all" if row.peer.host == "0.0.0.0" else str(row.peer).removesuffix(":0"),
             "meaning": NAMED[_named(row)].meaning if _named(row) in NAMED else ""} for row in rows]  # fmt: skip
