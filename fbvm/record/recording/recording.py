"""Records runs: what cannot be computed again; in memory of as many of the last scans as there is room for, in a file of all."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence

from fbvm.base.areas import BUDGET
from fbvm.base.memory import changes
from fbvm.engine.choice.tiers import python_of
from fbvm.machine.plc import Plc
from fbvm.record.recording.chunks import Chunk, ScanInputs, UnitKeyframe
from fbvm.record.recording.file_writer import Described, PlcWriter, RecordingWriter
from fbvm.record.recording.recorded import RecordedPlc
from fbvm.record.trace.packets import add_tap
from fbvm.units.contract import ResumableUnit
from fbvm.watch.values import Value
from fbvm.wire.link import Event, Network
from fbvm.wire.tap import TapEvent

RING_BYTES = 64 << 20
"""How much memory a recording takes before its oldest scans give way."""
AGAIN_NS = 25_000_000
"""About how long it may take to execute again what lies between two keyframes."""
CALL_NS, SCAN_NS = 45_000, 300
"""About what a call of `Plc.scan` takes beside its statements, with reading its inputs from a file; and each scan of a call that
does many."""
STATEMENT_NS = {True: 2, False: 190}
"""About what a statement takes in machine code, and in Python."""
BASE_KEYFRAMES = 64
"""So many keyframes are kept as what differs from one before them."""
MOST_INPUT_BYTES = 1 << 20
"""Behind a keyframe; then comes another one."""


class Recording:
    """The recording of a run: each PLC by its name, in `limit_bytes` of memory for all of them together.  With
    `file` it is written there, too, whole.

    >>> from fbvm import Plc, Recording, compile_text
    >>> plc = Plc(compile_text("PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM").image)
    >>> recording = Recording()
    >>> recorded = recording.add("pump", plc)
    >>> plc.run(scans=1000)
    'scans'
    >>> recorded.at(41).read("Main.n"), recording["pump"].scans
    (41, range(0, 1000))
    """

    def __init__(self, limit_bytes: int = RING_BYTES, file: RecordingWriter | None = None) -> None:
        self._limit_bytes, self._file = limit_bytes, file
        self._plcs: dict[str, PlcRecording] = {}
        self.size_bytes = 0
        """About how much memory is taken, without what follows the last keyframes."""

    def add(self, name: str, plc: Plc, described: Described | None = None) -> PlcRecording:
        """Records a PLC from its next scan on; `described` is what its file tells beside the scans.

        Raises ValueError for a name that is taken or a PLC that is recorded."""
        if name in self._plcs:
            raise ValueError(f"a PLC {name} is recorded already")
        written = self._file.add(name, plc, described or Described()) if self._file else None
        made = self._plcs[name] = PlcRecording(plc, self._grown, written)
        return made

    def __getitem__(self, name: str) -> PlcRecording:
        return self._plcs[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._plcs)

    def flush(self) -> None:
        """Writes what is not in the file yet, so that a reader sees it."""
        if self._file:
            self._file.flush()

    def close(self) -> None:
        """Ends the recording; what was recorded stays.  The file stays open."""
        for recorded in self._plcs.values():
            recorded.close()

    def _grown(self, size_bytes: int) -> None:
        """Called when a PLC has so many more bytes; the oldest scans of all PLCs give way if there are too many."""
        self.size_bytes += size_bytes
        while self.size_bytes > self._limit_bytes:
            oldest = min((found for found in self._plcs.values() if found.may_shrink), key=lambda found: found.oldest_ns,
                         default=None)  # fmt: skip
            if oldest is None:
                return
            self.size_bytes -= oldest.shrink()


class PlcRecording(RecordedPlc):
    """The recording of one PLC.  `grown` is called with the bytes of each keyframe and what lies before it; `written` puts it
    into a file."""

    def __init__(self, plc: Plc, grown: Callable[[int], None], written: PlcWriter | None = None) -> None:
        if plc.input_recorder:
            raise ValueError("this PLC is recorded already")
        self._plc, self._grown, self._written = plc, grown, written
        self._chunks: list[Chunk] = []
        self._base: Chunk | None = None
        """The keyframe from which the last ones are kept as differences; and how many these are."""
        self._since_base = 0
        self._sizes: list[int] = []
        """Of each chunk but the last what it takes."""
        self._substituted: list[int] = []
        self._pending = ScanInputs(plc.scans)
        self._now_ns = 0
        """The time of the scan that has begun."""
        self._has_begun = False
        """True between `before` and `after`."""
        self._has_changed = True
        """True if the state was changed by something that is no input."""
        self._system = plc.memory.views["i64"]
        self._known = bytes(plc.memory.size)
        """The memory at the end of the last scan, unless that `is_uncopied`."""
        self._is_alone = self._is_uncopied = False
        """True while nobody outside has a turn between two scans; true if the memory is as the last scan has left it, without
        having been copied."""
        self._before_refresh = b""
        self._units: list[ResumableUnit] = []
        """Those whose settings are inputs, and how often they have been set."""
        self._times_set: list[int] = []
        self._forces: dict[str, Value] = {}
        self._budget = 0
        self._cost_ns = 0
        self._networks: list[Network] = []
        """Those that are tapped, for the units with these addresses."""
        self._addresses: set[str] = set()
        self.wants_plain_scans = False
        if written:
            written.memory = self._memory
        plc.record_inputs(self)

    def close(self) -> None:
        """Ends the recording; what was recorded stays."""
        self._addresses = set()
        self._plc.record_inputs(None)
        if self._written:
            self._written.close((self._now_ns, self._pending) if self._has_begun else None)
            self._written = None

    # --- what was recorded --------------------------------------------------------------------------------------------

    @property
    def scans(self) -> range:
        """The scans that can be executed again, without one that has begun and not ended."""
        if not self._chunks:
            return range(0)
        return range(self._chunks[0].first, min(self._chunks[-1].times.end, self._plc.scans))  # it may have gone back

    @property
    def begun(self) -> range:
        """The scans that can be executed again; one that was interrupted is executed to the end that it would have had."""
        return range(self.scans.start, self.scans.stop + self._has_begun)

    def chunk(self, scan: int) -> Chunk:
        """The keyframe before a scan, and what follows up to the next one."""
        return self._chunks[bisect_right(self._chunks, scan, key=lambda chunk: chunk.first) - 1]

    def inputs(self, scan: int) -> ScanInputs | None:
        """The inputs of a scan, if there are any."""
        if self._has_begun and scan == self.scans.stop:
            return self._pending
        return self.chunk(scan).inputs_of(scan)

    def now_ns(self, scan: int) -> int:
        """The time of a scan."""
        return self._now_ns if scan == self.scans.stop else self.chunk(scan).times.at(scan)

    @property
    def plc(self) -> Plc:
        """The PLC that is recorded."""
        return self._plc

    @property
    def substituted(self) -> Sequence[int]:
        """The bodies that Python stands in for."""
        return self._substituted

    # --- what may not be repeated -------------------------------------------------------------------------------------

    def substitute(self, body: int, function: Callable[[int], None]) -> None:
        """Executes a Python function in place of a body.  Its results are recorded: it is not called again.

        Raises ValueError for a PLC that runs machine code only, and once a scan has been recorded."""
        if self._chunks:
            raise ValueError("Python takes the place of a block before the first scan that is recorded")
        plc, size = self._plc, self._plc.image.bodies[body].instance_size
        memory = plc.memory

        def recorded(base: int) -> None:
            function(base)
            result, results = (base, memory.map[base : base + size]), self._pending.results
            if isinstance(results, list):
                results.append(result)
            else:
                self._pending.results = [result]

        python_of(plc.engine).substitute(body, recorded)
        self._substituted.append(body)

    # --- called by the PLC: InputRecorder -----------------------------------------------------------------------------

    def before(self, now_ns: int) -> None:
        """Records what was changed from outside since the last scan; begins a chunk if it is time."""
        plc, pending = self._plc, self._pending
        self._now_ns = now_ns
        goes_on = not self._has_changed and not self._has_begun and plc.scans == self._chunks[-1].times.end
        follows = goes_on and not self._note_changes(plc, pending)
        if not goes_on or self._cost_ns > AGAIN_NS:
            self._begin_chunk(follows)
        self._has_begun = True

    def _note_changes(self, plc: Plc, pending: ScanInputs) -> bool:
        """Adds what was changed from outside since the last scan to `pending`; returns True if something was."""
        found = False
        if not self._is_uncopied and (memory := plc.memory.map[:]) != self._known:
            if self._written:
                self._written.settle()
            pending.writes = [*pending.writes, *changes(self._known, memory)]
            self._known, found = memory, True
        if plc.budget != self._budget:
            pending.budget = self._budget = plc.budget
            found = True
        if (plc.is_forced or self._forces) and (forces := plc.forces) != self._forces:
            pending.forces = self._forces = forces
            found = True
        for number, unit in enumerate(self._units):
            if unit.times_set != self._times_set[number]:
                self._times_set[number] = unit.times_set
                pending.settings = {**pending.settings, number: unit.settings}
                found = True
        return found

    def received(self, unit: int, events: Sequence[Event]) -> None:
        """Records events of the network for a unit."""
        self._pending.events.setdefault(unit, []).extend(events)

    def refresh_begins(self) -> None:
        """Keeps the memory before a refresh that cannot be done again."""
        if self.wants_plain_scans:
            self._before_refresh = self._plc.memory.map[:]

    def refresh_ended(self) -> None:
        """Records what a refresh changed that cannot be done again."""
        if self.wants_plain_scans:
            self._pending.refreshed = [*self._pending.refreshed, *changes(self._before_refresh, self._plc.memory.map[:])]

    def after(self, scans: int, now_ns: int, step_ns: int = 0) -> None:
        """Records the times of some scans, and with the last of them what was told since `before`."""
        self._has_begun = False
        if not scans:
            return
        plc, chunk, pending, written = self._plc, self._chunks[-1], self._pending, self._written
        if plc.trap:
            pending.watch = plc.watch_cycle.ended(plc.trap, plc.budget)
        chunk.times.add(now_ns, scans, step_ns)
        self._is_uncopied = self._is_alone
        if not self._is_alone:
            self._known = plc.memory.map[:]
        machine = plc.engine.machine is not None
        if machine:
            chunk.machine = True
        self._cost_ns += CALL_NS + scans * (SCAN_NS + STATEMENT_NS[machine] * (plc.budget - self._system[BUDGET // 8]))
        has_inputs = not pending.is_empty
        if has_inputs:
            self._put(chunk, pending, scans)
            self._pending = ScanInputs(plc.scans)
            if chunk.inputs_bytes > MOST_INPUT_BYTES:
                self._cost_ns = AGAIN_NS + 1
        if written and (has_inputs or written.wants_each_scan):
            written.ended()

    def run_begins(self) -> None:
        """Until `run_ends`, nobody outside has a turn between two scans: memory need not be compared."""
        self._is_alone = True

    def run_ends(self) -> None:
        """From here on the memory may be changed from outside."""
        self._is_alone, self._known, self._is_uncopied = False, self._memory(), False

    def _memory(self) -> bytes:
        """The memory at the end of the last scan."""
        return self._plc.memory.map[:] if self._is_uncopied else self._known

    def changed(self) -> None:
        """The next scan begins a chunk."""
        self._has_changed = True

    def _put(self, chunk: Chunk, pending: ScanInputs, scans: int) -> None:
        """Adds inputs to those of the scans that just ended: what came from outside to the first, what units were told to the
        last one."""
        first, last = self._plc.scans - scans, self._plc.scans - 1
        pending.scan = first
        if scans > 1 and (pending.events or pending.traffic or pending.watch):
            told = ScanInputs(last, events=pending.events, traffic=pending.traffic, watch=pending.watch)
            pending.events, pending.traffic, pending.watch = {}, [], None
            if not pending.is_empty:
                chunk.add(pending)
            pending = told
        chunk.add(pending)

    def _begin_chunk(self, follows: bool = False) -> None:
        """Keeps the state of PLC and units as a keyframe; `follows` if the last scan of the chunk before leads to it."""
        plc, chunks = self._plc, self._chunks
        if self._written:
            self._written.flush()
        while chunks and chunks[-1].first >= plc.scans:  # the PLC went back, or a chunk begins again
            chunks.pop()
            if self._sizes:
                self._grown(-self._sizes.pop())
        if chunks:
            chunks[-1].cut(plc.scans)
            self._pack()
            size = chunks[-1].size_bytes(chunks[-2] if len(chunks) > 1 else None)
            self._sizes.append(size)
        units = [attached.unit for attached in plc.units]
        again = [unit for unit in units if isinstance(unit, ResumableUnit)]
        self.wants_plain_scans = len(again) < len(units)
        self._units = [] if self.wants_plain_scans else again
        frames = [UnitKeyframe(unit, unit.state) for unit in self._units] or [UnitKeyframe(unit, None) for unit in units]
        self._listen()
        self._times_set = [unit.times_set for unit in self._units]
        chunks.append(Chunk(plc.snapshot(), frames, plc.budget, follows))
        self._pending = ScanInputs(plc.scans, traffic=self._pending.traffic)
        self._known, self._is_uncopied = plc.memory.map[:], False
        self._forces, self._budget = plc.forces, plc.budget
        self._cost_ns, self._has_changed = 0, False
        if self._written:
            self._written.began(chunks[-1], self._substituted)
        if len(chunks) > 1:
            self._grown(self._sizes[-1])

    def _pack(self) -> None:
        """Packs the last keyframe, behind which another one comes; one in so many stays as it is, the base of those behind it."""
        last = self._chunks[-1]
        self._since_base += 1
        if self._base is None or self._base.first > last.first or self._since_base > BASE_KEYFRAMES:
            self._base, self._since_base = last, 0
        elif last is not self._base:
            last.pack(self._base)

    def _listen(self) -> None:
        """Taps the networks of units that are new."""
        self._addresses = {attached.unit.address for attached in self._plc.units}
        for network in {id(attached.network): attached.network for attached in self._plc.units}.values():
            if network not in self._networks:
                self._networks.append(network)
                add_tap(network, self._passed)

    def _passed(self, now_ns: int, unit: str, event: TapEvent) -> None:
        """Records an event of the network at a unit of this PLC."""
        if unit in self._addresses:
            self._pending.traffic.append((now_ns, unit, event))

    # --- the ring -----------------------------------------------------------------------------------------------------

    @property
    def may_shrink(self) -> bool:
        """True if there is a keyframe that may give way."""
        return len(self._chunks) > 1

    @property
    def oldest_ns(self) -> int:
        """The time of the oldest keyframe."""
        return self._chunks[0].state.now_ns

    def shrink(self) -> int:
        """Forgets the oldest keyframe and the scans up to the next one; returns how many bytes that gives back."""
        before = sum(self._sizes[:2])
        del self._chunks[0], self._sizes[0]
        if self._sizes:
            self._sizes[0] = self._chunks[0].size_bytes(None)
        return before - (self._sizes[0] if self._sizes else 0)


