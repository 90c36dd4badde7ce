"""A PLC as its pages see it: its recording, its source, its frames, and what somebody did to it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from io import BytesIO
from typing import Any

from fbvm.analysis.comments import declared_comments
from fbvm.live.program import Drawn, PowerView, ScanView, instances
from fbvm.machine.plc import Plc
from fbvm.machine.power import Power, powering
from fbvm.record.export.pcapng import Capture
from fbvm.record.recording.recording import PlcRecording
from fbvm.record.recording.scans import RecordedScans
from fbvm.record.trace.observing import observing
from fbvm.record.trace.packets import Dissector, Packet, add_tap
from fbvm.record.trace.writer import descriptions, meanings, source_lines
from fbvm.watch.names import Names
from fbvm.watch.paths import Place, UnknownPlace
from fbvm.wire.tap import TapEvent

MOST_PACKETS = 2000
"""Frames that are kept of a PLC, the latest ones."""
MOST_CAPTURE_BYTES = 2 << 20


@dataclass
class Traffic:
    """What has passed between two addresses: how many frames, and the last of them."""

    one: str
    other: str
    frames: int = 0
    info: str = ""


class LivePlc:
    """A PLC under the name that pages know, with `texts`, its sources by name, and its recording."""

    def __init__(self, name: str, plc: Plc, recorded: PlcRecording, texts: Mapping[str, str],
                 ended: Callable[[], bool] = lambda: False, watch: Sequence[str] = ()) -> None:  # fmt: skip
        self.watch = watch
        """Names that a page watches at first."""
        self.ended = ended
        """True when the run has come to the end that was said for it."""
        self.name, self.plc, self.recorded, self.texts = name, plc, recorded, texts
        self.names = Names.of(plc.image, plc.memory.areas)
        self.described, self.meanings = descriptions(plc), meanings(plc)
        self._comments = declared_comments(texts.values())
        self._owners: dict[str, str] = {}
        """The type of the instance or structure of this path, in upper case; "" for what is none."""
        self.instances = instances(plc.image)
        self.past = RecordedScans(recorded, source_lines(plc.image, texts))
        self.view: ScanView | None = None
        """What happened inside the scan that was observed last."""
        self._drawn: Drawn = {}
        self.wants_view = False
        """True if the next scan is to be observed."""
        self._observing = ExitStack()
        self._powering = ExitStack()
        self.power: Power | None = None
        """The power in rungs and charts as machine code notes it; None while it does not."""
        self.packets: deque[tuple[int, int, Packet]] = deque(maxlen=MOST_PACKETS)
        """Number, scan and content of frames; numbers count on."""
        self.frames = 0
        self._events: deque[tuple[int, int, str, TapEvent]] = deque(maxlen=MOST_PACKETS)
        self.traffic: dict[str, Traffic] = {}
        """What has passed between the units of this PLC and others, by the two addresses."""
        self._addresses = {attached.unit.address for attached in plc.units}
        self._dissector = Dissector()
        for network in {id(attached.network): attached.network for attached in plc.units}.values():
            add_tap(network, self._passed)

    def said(self, place: Place) -> str:
        """The comment of a variable where it is declared; of a word or a bit what its unit calls it."""
        if not self._comments or place.area:
            return self.described.get(place.name, "")
        path, _, last = place.name.rpartition(".")
        if path not in self._owners:
            found = self.plc.find(path) if path else None
            self._owners[path] = found.type.name.upper() if isinstance(found, Place) else ""
        return self._comments.get((self._owners[path], last.partition("[")[0].upper()), "")

    def wish_view(self, is_paused: bool) -> None:
        """Has the next scan observed.  With real connections only while the run is paused and goes scan by scan: Python alone
        observes, which would take time from the peers; else machine code notes the power in rungs."""
        self.wants_view = is_paused or not self.is_real
        has_power = bool(self.plc.image.rungs or self.plc.image.charts)
        if not self.wants_view and has_power and self.power is None and not self.plc.breakpoints.armed:
            self.power = self._powering.enter_context(powering(self.plc))

    def end_power(self) -> None:
        """Machine code notes power no longer: nobody looks, or somebody else looks into scans."""
        if self.power is not None:
            self.power = None
            self._powering.close()

    def view_of(self, instance: str) -> ScanView | PowerView | None:
        """What is known of the inside of the last scans of an instance; None for nothing yet."""
        try:
            return PowerView(self.plc, self.power, instance, self._drawn) if self.power else self.view
        except UnknownPlace:  # the page of another program
            return None

    @property
    def is_real(self) -> bool:
        """True if the PLC has real connections, and so real time."""
        return not all(attached.network.virtual_time for attached in self.plc.units)

    def state(self, is_paused: bool) -> str:
        """How the PLC goes on, as pages name it."""
        plc = self.plc
        return "trap" if plc.trap else "halt" if plc.halted else "ended" if self.ended() else "pause" if is_paused else "run"

    def before_scan(self) -> None:
        """Observes the next scan if somebody wants to see inside."""
        if self.wants_view or self.plc.breakpoints.armed:
            self.end_power()
        if self.wants_view and not self.plc.trap and not self.plc.breakpoints.armed:
            self.wants_view = False
            view = ScanView(self.plc.image, self.plc.memory.areas, self.names, self._drawn)
            self._observing.enter_context(observing(self.plc, view))
            self.view = view

    def after_scan(self) -> None:
        """The scan has ended: it is observed no longer.  One with breakpoints was not, and is executed again for the view."""
        self._observing.close()
        plc = self.plc
        stands = plc.halted or self.is_real or plc.scans - 1 not in self.recorded.scans
        if self.wants_view and plc.breakpoints.armed and not stands:
            self.wants_view = False
            self.view = self.past_view(plc.scans - 1)

    def past_view(self, scan: int) -> ScanView:
        """What happened inside a recorded scan, which is executed again."""
        view = ScanView(self.plc.image, self.plc.memory.areas, self.names, self._drawn)
        self.recorded.follow(view, range(scan, scan + 1))
        return view

    def frame_rows(self, after: int, scan: int | None, most: int = 200) -> list[dict[str, Any]]:
        """The frames with numbers from `after` on, the latest ones; with `scan` those up to this scan."""
        rows = [(number, at, packet) for number, at, packet in self.packets if number >= after and (scan is None or at <= scan)]
        return [{"number": number, "scan": at, "ns": packet.now_ns, "from": str(packet.source), "to": str(packet.destination),
                 "info": packet.info, "data": packet.data[:1500].hex(),
                 "out": packet.source.host in self._addresses} for number, at, packet in rows[-most:]]  # fmt: skip

    def capture(self) -> bytes:
        """The last events of the network as a pcapng file, with the numbers of their scans as comments."""
        kept: list[tuple[int, int, str, TapEvent]] = []
        size = 0
        for row in reversed(self._events):
            size += len(row[3].data) + 200
            if size > MOST_CAPTURE_BYTES:
                break
            kept.insert(0, row)
        file, scan = BytesIO(), [0]
        capture = Capture(file, comment=lambda address: f"scan {scan[0]}")
        for scan[0], now_ns, unit, event in kept:
            capture.tap(now_ns, unit, event)
        return file.getvalue()

    def _passed(self, now_ns: int, unit: str, event: TapEvent) -> None:
        """Keeps what passes at a unit of this PLC, with the number of the scan that it belongs to."""
        if unit in self._addresses:
            self._events.append((self.plc.scans, now_ns, unit, event))
            for packet in self._dissector.dissect(now_ns, event):
                one, other = sorted((packet.source.host, packet.destination.host))
                known = self.traffic.setdefault(f"{one} {other}", Traffic(one, other))
                known.frames, known.info = known.frames + 1, packet.info
                self.packets.append((self.frames, self.plc.scans, packet))
                self.frames += 1
