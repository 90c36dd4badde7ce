"""What stops a run between two scans: a Modbus exception reply, a response code of a unit that is not 0, a late scan, a scan
whose memory is not the recorded one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from fbvm.machine.plc import Plc
from fbvm.record.trace.packets import add_tap
from fbvm.watch.paths import Place
from fbvm.watch.values import show_time
from fbvm.wire.link import Peer
from fbvm.wire.modbus import Adu, Splitter, decode_reply
from fbvm.wire.tap import DATA, TapEvent, TapKind

RESPONSE_CODE = "Response Code"
"""How units call the word of their response code."""


class Filter(NamedTuple):
    """An exception filter: its name, what people read, what stops there, and whether it is on at first."""

    name: str
    label: str
    description: str
    default: bool
    condition: str = ""
    """What a condition may be, "" if there is none."""


FILTERS = (
    Filter("trap", "Traps", "an index outside its array, a division by zero, ...", True),
    Filter("watchdog", "Watchdog", "a scan has used up its statements, or its watch cycle time", True),
    Filter("modbus", "Modbus exception replies", "a reply with an exception code passed the network", False,
           "the code, such as 2"),
    Filter("response", "Response codes that are not 0", "an Ethernet unit ended a request with a response code", True,
           "the code, such as 16#0302"),
    Filter("late", "Late scans", "with real connections: a scan began a period or more after it was due", False,
           "the delay in ms, such as 5"),
    Filter("differs", "Scans that differ from the recording", "this version of fbvm computes another memory than was recorded",
           True),
    Filter("warning", "Warnings of the run", "what the program asks and the PLC does not do", False),
)  # fmt: skip
"""Traps stop a run whether or not their filters are on: nothing continues behind one."""
BETWEEN = ("modbus", "response", "late", "differs")
"""The filters that are looked at between two scans."""


@dataclass
class BetweenScans:
    """The filters of `BETWEEN` of one PLC.  `wanted` has those that are on, with their codes, none for all.

    `differs` says of a scan of a recording whether its memory is the first that is not the recorded one."""

    wanted: Mapping[str, frozenset[int]]
    differs: Callable[[int], bool] | None = None
    found: str = ""
    kind: str = ""

    def attached(self, plc: Plc) -> None:
        """Listens to the networks of a PLC."""
        self._streams: dict[tuple[Peer, Peer, bool], Splitter] = {}
        self._passed: list[str] = []
        self._codes = {place.name: place for place in _response_codes(plc)}
        self._before = {name: plc.read(place) for name, place in self._codes.items()}
        self._began_ns = plc.now_ns
        if "modbus" in self.wanted:
            for network in {id(attached.network): attached.network for attached in plc.units}.values():
                add_tap(network, self._tap)

    def checked(self, plc: Plc) -> bool:
        """Called after each scan: True if something of what is wanted has happened in it."""
        if self._is_late(plc):
            return True
        if "differs" in self.wanted and self.differs and self.differs(plc.scans - 1):
            self.found = f"scan {plc.scans - 1} comes out differently here: its memory is not the recorded one"
            self.kind = "differs"
            return True
        passed, self._passed = self._passed, []
        if passed:
            self.found, self.kind = passed[0], "modbus"
            return True
        now = {name: plc.read(place) for name, place in self._codes.items()}
        before, self._before = self._before, now
        if "response" not in self.wanted or now == before:
            return False
        codes = self.wanted["response"]
        for name, value in now.items():
            if isinstance(value, int) and value and value != before[name] and (not codes or value in codes):
                meaning = _meaning(plc, name, value)
                self.found, self.kind = f"{name} {RESPONSE_CODE} is 16#{value:04X}{meaning}", "response"
                return True
        return False

    def _is_late(self, plc: Plc) -> bool:
        """True if the last scan began too late.  In virtual time none does."""
        began_ns, self._began_ns = self._began_ns, plc.now_ns
        late_ns = plc.now_ns - began_ns - plc.cycle_ns
        if "late" not in self.wanted or late_ns < min((ms * 1_000_000 for ms in self.wanted["late"]), default=plc.cycle_ns):
            return False
        if plc.scans < 2 or late_ns <= 0:
            return False
        self.found, self.kind = f"scan {plc.scans - 1} began {show_time(late_ns)[2:]} late", "late"
        return True

    def _tap(self, now_ns: int, unit: str, event: TapEvent) -> None:
        if event.kind is TapKind.OPEN:  # ports come again: what an earlier connection has left is not this one's
            for out in (True, False):
                self._streams.pop((event.local, event.remote, out), None)
        if event.kind is not DATA or event.mirrored and not event.out:  # its other end has told of it
            return
        stream = self._streams.setdefault((event.local, event.remote, event.out), Splitter())
        for frame in stream.feed(event.data):
            if isinstance(frame, Adu) and frame.pdu and frame.pdu[0] & 0x80:
                reply = decode_reply(frame.pdu)
                codes = self.wanted["modbus"]
                if reply.exception and (not codes or reply.exception in codes):
                    self._passed.append(f"Modbus {frame.transaction}, unit {frame.unit}: {reply}")


def _response_codes(plc: Plc) -> Iterable[Place]:
    """The words of response codes of all units of a PLC."""
    for attached in plc.units:
        for address, name in getattr(attached.unit, "descriptions", {}).items():
            if name.startswith(RESPONSE_CODE) and isinstance(found := plc.find(address), Place):
                yield found


def _meaning(plc: Plc, address: str, value: int) -> str:
    for attached in plc.units:
        if text := getattr(attached.unit, "meanings", {}).get(address, {}).get(value):
            return f": {text}"
    return ""


