"""A unit with a processor of its own: sends a number when it is asked to, and shows a while later what came back.

Its words: in CIO the request switch (bit 0), a switch for a trap (bit 1), the busy flag, how often it ran, what came last;
in D the number, how many requests have ended; in W a word in which several units have a bit each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fbvm.processor.processor import OwnProcessor, processor
from fbvm.units.contract import AreaMemory, Exchanged, ExchangedWords
from fbvm.wire.link import Event, Link, Received, Request, Send, Sent

PROGRAM = """
VAR_GLOBAL
    Words : ARRAY[0..3] OF WORD; Table : ARRAY[0..6] OF WORD; Shared : ARRAY[0..3] OF WORD; Bit : WORD; Delay : LTIME;
    Happened : ARRAY[0..15] OF UDINT; Posted : UDINT; Asked : ARRAY[0..1] OF UDINT; Requested : UDINT;
    Wake : LTIME := LTIME#100000d; News : BOOL;
END_VAR
PROGRAM Toy
VAR Ending : LTIME; Busy, Waits : BOOL; i : UDINT; n : UINT; Zero : WORD; END_VAR
    Requested := 0;
    Words[2] := UINT_TO_WORD(WORD_TO_UINT(Words[2]) + 1);
    IF Posted > 0 THEN
        FOR i := 0 TO Posted - 1 DO
            IF Happened[i] >= 16#10000 THEN Words[3] := UDINT_TO_WORD(Happened[i]); END_IF;
            IF Happened[i] >= 16#10000 AND Busy THEN Waits := TRUE; Ending := LTIME() + Delay; END_IF;
        END_FOR;
    END_IF;
    Posted := 0;
    IF Waits AND LTIME() >= Ending THEN
        Words[0].0 := FALSE; Words[1].0 := FALSE; Busy := FALSE; Waits := FALSE;
        Table[1] := UINT_TO_WORD(WORD_TO_UINT(Table[1]) + 1); Shared[1] := Shared[1] XOR Bit; n := n + 1;
    END_IF;
    IF Words[0].0 AND NOT Busy THEN
        Busy := TRUE; Words[1].0 := TRUE;
        Asked[0] := WORD_TO_UDINT(Table[0]); Requested := 1;
        IF Table[0].3 THEN Asked[1] := 16#55; Requested := 2; END_IF;
    END_IF;
    IF Words[0].1 THEN n := n / WORD_TO_UINT(Zero); END_IF;
    Wake := LTIME#100000d;
    IF Waits THEN Wake := Ending; END_IF;
    IF n MOD 5 = 3 THEN Wake := LTIME#0s; n := n + 1; END_IF;
    Table[2] := UDINT_TO_WORD(SHL(Requested, 3));
    News := TRUE;  // it counts its runs
END_PROGRAM
"""
NEVER_NS = 1 << 62


class Toy:
    """Number 0 to 3; its answer takes effect `delay_ns` after it has come.  With `is_inside` its processor may be run
    elsewhere than in `refresh`."""

    configuration: dict[str, Any] = {}  # noqa: RUF012
    settings: dict[str, Any] = {}  # noqa: RUF012

    def __init__(self, number: int = 0, delay_ns: int = 0, is_inside: bool = True) -> None:
        self.name, self.address = f"Toy {number}", f"192.168.250.{number + 1}"
        self.is_inside = is_inside
        self._bit, self._delay_ns = 1 << number, delay_ns
        self._cio, self._d = 1500 + 4 * number, 20_000 + 7 * number
        places = (("CIO", self._cio, "Words"), ("D", self._d, "Table"), ("W", 4, "Shared"))
        self.words = tuple(ExchangedWords(area=area, first=first, variable=name) for area, first, name in places)
        self._engine = "auto"
        self._begin()

    @property
    def exchanged(self) -> Exchanged | None:
        return Exchanged(processor=self.own, words=self.words, posted="Posted", urgent="Requested", unfinished=("Requested",),
                         wake="Wake") if self.is_inside else None  # fmt: skip

    @property
    def watched(self) -> Sequence[tuple[str, int]]:
        return ("CIO", self._cio), ("W", 4)

    def _begin(self) -> None:
        self.own: OwnProcessor = processor(PROGRAM, self._engine)
        self.own.view("Bit")[0], self.own.view("Delay")[0] = self._bit, self._delay_ns
        self.connect()
        self.changed_words, self.refreshes, self._has_run = False, 0, False

    @property
    def wake_ns(self) -> int:
        return self._wake[0] if self._has_run else 0

    def connect(self) -> None:
        """Use the processor that there is."""
        self._posted, self._happened = self.own.view("Posted"), self.own.view("Happened")
        self._wake, self._requested = self.own.view("Wake"), self.own.view("Requested")
        self._asked, self._news = self.own.view("Asked"), self.own.view("News")

    def reset(self, memory: AreaMemory) -> list[Request]:
        self._begin()
        for plc, own in self._views(memory)[:2]:
            plc[:] = memoryview(bytes(2 * len(own))).cast("H")
        return []

    def run_on(self, engine: str) -> None:
        self._engine = engine
        self.own.run_on(engine)

    def prepare(self) -> None:
        """Its program is ready from the beginning."""

    def post(self, events: Sequence[Event]) -> None:
        for event in events:
            if self._posted[0] < 16:
                self._happened[self._posted[0]] = 0x10000 | event.data[0] if isinstance(event, Received) else 1
                self._posted[0] += 1

    def refresh(self, memory: AreaMemory, events: Sequence[Event], now_ns: int) -> list[Request]:
        return self.finish() if self.exchange(memory, events, now_ns) else []

    def move(self, memory: AreaMemory) -> None:
        """It never leaves anything."""

    def exchange(self, memory: AreaMemory, events: Sequence[Event], now_ns: int) -> bool:
        self.refreshes += 1
        self.post(events)
        views = self._views(memory)
        changed = any(plc != own for plc, own in views[::2])
        if not changed and not self._posted[0] and now_ns < self._wake[0] and self._has_run:
            self.changed_words = False
            return False
        self._has_run = True
        for plc, own in views:
            own[:] = plc
        self.own.run(now_ns)
        for plc, own in views:
            plc[:] = own
        self.changed_words = bool(self._news[0])
        return True

    def _views(self, memory: AreaMemory) -> list[tuple[memoryview, memoryview]]:
        """The exchanged words, in the PLC's memory and in the processor's."""
        views = [(words, self.own.view(words.variable)) for words in self.words]
        return [(memory.words(words.area)[words.first : words.first + len(own)], own) for words, own in views]

    def finish(self) -> list[Request]:
        return [Send(1, bytes([value & 0xFF])) for value in self._asked[: self._requested[0]]]


class Echoing:
    """A network that takes bytes at once, and gives them back later; what was asked of it is in `log`."""

    driven = False

    def __init__(self, latency_ns: int = 0, virtual_time: bool = True, is_restless: bool = False) -> None:
        self.virtual_time, self._latency_ns, self._is_restless = virtual_time, latency_ns, is_restless
        self.links: list[_Echo] = []
        self.now_ns = 0

    def attach(self, address: str) -> Link:
        self.links.append(_Echo(address, self._latency_ns, self._is_restless, self))
        return self.links[-1]

    def wait(self, timeout_s: float) -> bool:
        return bool(self.links)

    def serve(self, now_ns: int) -> Sequence[Link]:
        self.now_ns = max(self.now_ns, now_ns)
        return [link for link in self.links if not link.is_quiet]

    def close(self) -> None:
        """Nothing is open."""

    @property
    def log(self) -> list[tuple[str, int, int, bytes]]:
        return [row for link in self.links for row in link.log]


class _Echo:
    def __init__(self, address: str, latency_ns: int, is_restless: bool, network: Echoing) -> None:
        self.address, self._latency_ns, self._is_restless, self._network = address, latency_ns, is_restless, network
        self._waiting: list[tuple[int, Event]] = []
        self.log: list[tuple[str, int, int, bytes]] = []
        """Where, at which refresh, when, what."""
        self.refreshes = 0
        """Only in virtual time: others may not count on being told of all."""

    @property
    def is_quiet(self) -> bool:
        if self._is_restless:
            return False
        if self._network.virtual_time:
            return not self._waiting
        return not any(due_ns <= self._network.now_ns for due_ns, _ in self._waiting)

    def submit(self, requests: Sequence[Request], now_ns: int) -> None:
        for request in requests:
            assert isinstance(request, Send)
            self.log.append((self.address, self.refreshes, now_ns, request.data))
            self._waiting.append((0, Sent(1, 1)))
            self._waiting.append((now_ns + self._latency_ns, Received(1, bytes([request.data[0] ^ 0xFF]))))

    def events(self, now_ns: int) -> Sequence[Event]:
        self.pass_by(1)
        until_ns = now_ns if self._network.virtual_time else self._network.now_ns
        told = [event for due_ns, event in self._waiting if due_ns <= until_ns]
        self._waiting = [(due_ns, event) for due_ns, event in self._waiting if due_ns > until_ns]
        return told

    def pass_by(self, refreshes: int) -> None:
        self.refreshes += refreshes if self._network.virtual_time else 0
