"""What is inside an ETN21: the processor, and views of those variables of its program that Python exchanges."""

from __future__ import annotations

from fbvm.processor.processor import OwnProcessor, processor
from fbvm.processor.processor import prepare as prepare_processor
from fbvm.units.addresses import words_of
from fbvm.units.etn21 import map as at
from fbvm.units.etn21.faults import Faults
from fbvm.units.etn21.mail import Mail
from fbvm.units.etn21.words import Words, numbers

PROGRAM = "PROGRAM Unit ETN21_Refresh(); END_PROGRAM"


def prepare(engine: str) -> None:
    """Compiles the program of all ETN21s for an engine, unless that has been done."""
    prepare_processor(PROGRAM, engine)


def power_on(layout: at.Layout, address: str, *, real: bool, seed: int, time_wait_ns: int, odd_filler: int | None,
             engine: str) -> Inside:  # fmt: skip
    """A processor with an ETN21's program that knows how its unit is made, before its first run.

    `real` turns delays and words out of step on, drawn from `seed`; `time_wait_ns` is how long a local port stays taken;
    `engine` is that of `processor`."""
    own = processor(PROGRAM, engine)
    own.view("ETN21_Unit_Bit")[0] = 1 << layout.bit
    ip = own.view("ETN21_IP")
    ip[0], ip[1] = words_of(address)
    own.view("ETN21_Real")[0] = real
    own.view("ETN21_Random")[0] = _scattered(seed)
    own.view("ETN21_Time_Wait")[0] = time_wait_ns
    return Inside(own, odd_filler)


class Inside:
    """The processor of one unit, and views of its memory by what they are for."""

    def __init__(self, own: OwnProcessor, odd_filler: int | None) -> None:
        self.own = own
        self.n, self.m = own.view("ETN21_N"), own.view("ETN21_M")
        self.initializing, self.restart = own.view("ETN21_Initializing"), own.view("ETN21_Restart")
        self.service_status = own.view("ETN21_Service_Status")
        self.error_status = own.view("ETN21_Error_Status")
        self.seen, self.reported = numbers(self.n)
        """As they were when the last refresh ended."""
        self.wake = own.view("ETN21_Wake")
        self.mail = Mail(own, odd_filler)
        self.faults = Faults(own)

    def copy(self, odd_filler: int | None) -> Inside:
        """Another processor in the same state."""
        twin = Inside(self.own.copy(), odd_filler)
        twin.mail.resume(*self.mail.state)
        return twin

    def report(self, service_status: int, error_status: int) -> None:
        """Tells the program what n+17 and n+18 show from the next refresh on."""
        self.service_status[0], self.error_status[0] = service_status, error_status
        self.wake[0] = 0

    def know(self, lengths: dict[int, int]) -> None:
        """Tells the program how many words the data areas have, by area code."""
        table, (first, count, _) = self.own.view("ETN21_Lengths"), self.own.contract.array("ETN21_Lengths")
        for number in range(count):
            table[number] = lengths.get(first + number, 0)

    def reset(self) -> None:
        """Makes the next run of the program a power-on."""
        self.mail.forget()
        self.own.view("ETN21_Reset")[0] = 1

    def run(self, words: Words, now_ns: int) -> bool:
        """Copies the unit's words in, runs the program at `now_ns`, copies them out.  Returns True if the run changed any."""
        self.n[:], self.m[:] = words.n, words.m
        self.initializing[:], self.restart[:] = words.initializing, words.restart
        before = self._state()
        self.own.run(now_ns)
        words.n[:], words.m[:] = self.n, self.m
        words.initializing[:], words.restart[:] = self.initializing, self.restart
        return self._state() != before

    def _state(self) -> tuple[bytes, bytes, int, int]:
        """The exchanged words as they are in the processor's memory."""
        return self.n.tobytes(), self.m.tobytes(), self.initializing[0], self.restart[0]


def _scattered(seed: int) -> int:
    """A state to draw numbers from that is far from those of seeds nearby, and not 0 (splitmix64, G. Steele 2014)."""
    mixed = (seed + 1) * 0x9E37_79B9_7F4A_7C15 & 0xFFFF_FFFF_FFFF_FFFF
    mixed = (mixed ^ mixed >> 30) * 0xBF58_476D_1CE4_E5B9 & 0xFFFF_FFFF_FFFF_FFFF
    mixed = (mixed ^ mixed >> 27) * 0x94D0_49BB_1331_11EB & 0xFFFF_FFFF_FFFF_FFFF
    return mixed ^ mixed >> 31 or 1
