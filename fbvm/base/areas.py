"""The memory areas of a PLC, where each lies in the flat buffer, and addresses such as `D100` or `CIO 1519.03`.

Omron areas count 16-bit words, the portable areas %I %Q %M count bytes.  The buffer begins with the system page (what
machine and engines exchange); behind the areas come the slots of globals and instances, E banks come last and
only if a program or a unit names them.  Before them lie the areas of units (mailboxes), if the program names any, and where
a PLC keeps %QX0.0, %QB0 and %QW0 apart an area for each size that the program names (`SIZED_AREAS`).
Sizes: W394 and etn21 facts, CS1/CJ1/CJ2 (CIO 6144, W 512, H 512 + 1024 for blocks, A 960, D 32768, 13 E banks, T/C 4096).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from fbvm.base.digits import whole_number

PAGE_BYTES = 4096


@dataclass(frozen=True)
class Area:
    """One area: `unit_bits` is 16 for word areas, 8 for byte areas, 1 for completion flags; `offset` in the buffer."""

    name: str
    offset: int
    count: int
    unit_bits: int
    read_only: int = 0
    """The number of units, from the first on, that a program must not write."""
    retained: bool = False
    """Kept over a warm start and a mode change."""
    title: str = ""
    """What it holds, for lists."""
    address_bits: int = 0
    """Of an area of SIZED_AREAS the size that all its addresses have, in bits; 0 where an address may have any size."""

    @property
    def size_bytes(self) -> int:
        return self.count * self.unit_bits // 8


_ROWS = (
    # name, offset, count, bits of a unit, read-only, retained, title; CF lies on the system page
    ("CF", 1024, 128, 1, 128, False, "condition flags and clock pulses"),
    ("CIO", 4096, 6144, 16, 0, False, "inputs, outputs and words of units"),
    ("W", 16384, 512, 16, 0, False, "work words"),
    ("H", 17408, 1536, 16, 0, True, "holding words"),
    ("A", 20480, 960, 16, 448, True, "auxiliary words of the system"),
    ("TF", 22528, 4096, 1, 0, False, "completion flags of timers"),
    ("CNF", 23040, 4096, 1, 0, True, "completion flags of counters"),
    ("T", 24576, 4096, 16, 0, False, "present values of timers"),
    ("C", 32768, 4096, 16, 0, True, "present values of counters"),
    ("I", 40960, 4096, 8, 0, False, "inputs of portable programs"),
    ("Q", 45056, 4096, 8, 0, False, "outputs of portable programs"),
    ("M", 49152, 65536, 8, 0, False, "memory of portable programs"),
    ("D", 114688, 32768, 16, 0, True, "data words"),
)
AREAS: dict[str, Area] = {row[0]: Area(*row) for row in _ROWS}
FLAG_AREAS = frozenset(("CF", "TF", "CNF"))
"""Areas that count bits."""
_SIZES = {"X": 1, "B": 8, "W": 16, "D": 32, "L": 64}
_SIZE_TITLES = {"X": "bits", "B": "bytes", "W": "words", "D": "double words", "L": "long words"}
SIZED_AREAS = {name: Area(name, 0, AREAS[area].count, 8, title=f"{AREAS[area].title}, {_SIZE_TITLES[size]}", address_bits=bits)
               for area in "IQM" for size, bits in _SIZES.items() for name in (f"%{area}{size}",)}
"""Areas in place of I, Q and M on a PLC that has memory of its own for each size of address, as those of OpenPLC and Beremiz
have: `%QX0.0` is bit 0 of the area %QX, and no bit of `%QW0`, the first word of the area %QW.  A map of areas has either I, Q
and M or of these the ones that the program names; `parse_address` goes by that.  Each goes as far as the shared area does.

Sources: OpenPLC's runtimes keep bool_output, byte_output, int_output, dint_output, lint_output and their like for inputs and
memory (image_tables); matiec makes of each located name a variable of its own, `__QX0_0` and `__QW0`."""
PORTABLE_AREAS = frozenset(("I", "Q", "M", *SIZED_AREAS))
"""Areas that count bytes and are written with a size, as in `%MW10`."""
FIXED_OR_SIZED_AREAS: Mapping[str, Area] = {**AREAS, **SIZED_AREAS}
"""All areas that one program or another has without an E bank or a unit, for what is said of them."""
INPUT_AREAS = frozenset(name for name in PORTABLE_AREAS if name.lstrip("%").startswith("I"))
OUTPUT_AREAS = frozenset(name for name in PORTABLE_AREAS if name.lstrip("%").startswith("Q"))
SHARED_AREAS = frozenset("IQM")
"""Those in which addresses of all sizes lie."""


def with_sizes_apart(areas: Mapping[str, Area], sized: Iterable[Area]) -> dict[str, Area]:
    """Areas of a PLC that keeps sizes of addresses apart: without I, Q and M, and with some of SIZED_AREAS."""
    return {**{name: area for name, area in areas.items() if name not in SHARED_AREAS}, **{area.name: area for area in sized}}

SLOTS_OFFSET = 180224
"""Where the slots of globals and instances begin."""

STACK_BYTES, LEAST_FRAMES, MOST_FRAMES = 1 << 16, 64, 512
"""Bytes of the stack of frames, which is larger if it would hold fewer than LEAST_FRAMES of the largest; how many it holds at
most, so that it ends before the host's own stack does."""
FRAME_HEAD, FRAME_LINK = 16, -8
"""Bytes in front of a frame on the stack; where, from the start of the frame, the reference to the one before of its POU lies."""

E_BANKS = 13
E_WORDS = 32768


def e_bank(name: str, offset: int) -> Area:
    """The area of E bank `name` ("E0".."EC") when it lies at `offset`."""
    return Area(name, offset, E_WORDS, 16, 0, True)


PLC_ADDRESSES = {"TF": 0xBE00, "CNF": 0xBF00, "CIO": 0xC000, "A": 0xD800, "H": 0xDC00, "W": 0xDE00, "T": 0xE000, "C": 0xF000,
                 "D": 0x10000}
"""PLC memory addresses of words, where index registers point (from memory of the family, assumed; those of flags count
16 of them).  Of H the first 512 words have one."""
E_PLC_ADDRESS = 0x18000
"""That of the first word of E bank 0; the other banks follow."""

E_NAMES = tuple(f"E{bank:X}" for bank in range(E_BANKS))


# --- areas of units --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Mailbox:
    """An area of a unit, through which the blocks of its library exchange words with the unit: words for the unit as a
    whole, then slots of equal size; an instance of a block claims a free slot."""

    name: str
    head_words: int
    slots: int
    slot_words: int

    @property
    def words(self) -> int:
        """The number of words in all."""
        return self.head_words + self.slots * self.slot_words

    def at(self, offset: int) -> Area:
        """The area when it lies at `offset`."""
        return Area(self.name, offset, self.words, 16)


MAILBOX_NAME = re.compile(r"[A-Z]{2,8}")
MAILBOX_MOST_WORDS = 1 << 20


def refusal(mailbox: Mailbox) -> str:
    """The error of a mailbox with a wrong name or size, "" if there is none."""
    name = mailbox.name
    if not MAILBOX_NAME.fullmatch(name) or name in AREAS or name == "DM":
        return f"{name!r} cannot name an area: write 2 to 8 capitals that no other area has"
    if min(mailbox.head_words, mailbox.slots, mailbox.slot_words) < 0 or not 0 < mailbox.words <= MAILBOX_MOST_WORDS:
        return f"{name} would have {mailbox.words} words; 1 to {MAILBOX_MOST_WORDS} are possible"
    return ""


# --- the system page ------------------------------------------------------------------------------------------------

NOW = 0
"""Time of the scan in ns since power-on, 64-bit signed."""
DUE = 8
"""Earliest moment (ns) at which a timer changes by itself; NEVER if none runs."""
BUDGET = 16
"""Statements that the scan may still execute, 64-bit signed."""
SCANS = 24
"""Number of scans done, 64-bit."""
CLOCK = 32
"""The PLC's clock: ns from 2000-01-01 00:00 to power-on, 64-bit signed."""
OPERATING = 40
"""0: MONITOR, in which FINS may force bits; 1: RUN."""
ACCESS_RIGHT = 48
"""Who has the access right by FINS: bit 24 is ON if anybody has; then unit, node and network, a byte each."""
CYCLE_TIMES = 64
"""Cycle times for FINS, 64-bit each: how many were measured, least and longest, then the last eight in ns."""
DATE_SECOND = 152
"""The second of the clock that A351 to A354 show, counted from 2000-01-01 00:00:00 on as 1; 0 before the first scan."""
NEVER = (1 << 63) - 1


# --- addresses ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Address:
    """A place in an area.  `number` counts units of the area (word areas) or of `size_bits` (I, Q, M).

    `bit` is None for a whole unit.  `size_bits` is 0 where the text names no size (Omron words)."""

    area: str
    number: int
    bit: int | None = None
    size_bits: int = 0

    def byte_offset(self) -> int:
        """Offset in bytes from the start of the area (of the byte that holds the bit, if one is named)."""
        if self.area in FLAG_AREAS:
            return self.number // 8
        unit = (self.size_bits or 8) // 8 if self.area in PORTABLE_AREAS else 2
        if self.bit is None:
            return self.number * unit
        return self.number * (1 if self.area in PORTABLE_AREAS else 2) + self.bit // 8

    def bit_in_byte(self) -> int:
        return self.number % 8 if self.area in FLAG_AREAS else (self.bit or 0) % 8

    def __str__(self) -> str:
        if self.area in SIZED_AREAS:
            if self.bit is None:
                return f"{self.area}{self.number}"
            number, rest = divmod(8 * self.number + self.bit, max(8, SIZED_AREAS[self.area].address_bits))
            return f"{self.area}{number}.{rest}"
        if self.area in PORTABLE_AREAS:
            size = "X" if self.bit is not None else {8: "B", 16: "W", 32: "D", 64: "L"}[self.size_bits or 8]
            return f"%{self.area}{size}{self.number}" + (f".{self.bit}" if self.bit is not None else "")
        bit = f".{self.bit:02}" if self.bit is not None else ""
        if self.area in FLAG_AREAS:
            return f"CF{self.number:03}" if self.area == "CF" else f"{self.area[0]}{self.number:04}"
        if self.area in E_NAMES:
            return f"{self.area}_{self.number}{bit}"
        return f"{self.area}{' ' if self.area == 'CIO' else ''}{self.number}{bit}"


_OMRON = re.compile(r"%?\s*(CIO|DM|D|W|H|A|TF|CNF|CF|T|C|E([0-9A-F])_|E([0-9A-F])\s*:)?\s*(\d+)(?:\.(\d+))?", re.I)
_PORTABLE = re.compile(r"%\s*([IQM])([XBWDL]?)(\d+)(?:\.(\d+))?", re.I)
_MAILBOX = re.compile(rf"%?\s*({MAILBOX_NAME.pattern})\s*(\d+)(?:\.(\d+))?", re.I)


class AddressError(ValueError):
    """The text is no address, or the address does not exist; the message says why."""


def parse_address(text: str, areas: Mapping[str, Area] = AREAS, words: bool = False) -> Address:
    """The address that `text` names: `D100`, `%D100`, `CIO 1519.03`, `1519.03`, `E0_100`, `%MW10`, `%IX0.3`.

    `areas` are the areas of the PLC, with those of its units; E banks are always known.  If I, Q and M are not among them, the
    address lies in one of SIZED_AREAS.  A bit of a larger unit is returned as a bit of one of its bytes; with `words` what counts
    behind %IX, %QX and %MX is words, %IX1.15 the last bit of the second one.  Raises AddressError for text that is no address,
    and for an address outside its area.

    >>> str(parse_address("1519.3")), str(parse_address("DM100")), str(parse_address("%MW4.15"))
    ('CIO 1519.03', 'D100', '%MX9.7')
    """
    text = text.strip()
    if match := _PORTABLE.fullmatch(text):
        return _portable(match, areas, words)
    match = _OMRON.fullmatch(text)
    if not match:
        mailbox = _MAILBOX.fullmatch(text)
        if mailbox and mailbox[1].upper() in areas:
            bit = whole_number(mailbox[3]) if mailbox[3] is not None else None
            return check_address(Address(mailbox[1].upper(), whole_number(mailbox[2]), bit), areas)
        raise AddressError(f"{text!r} is not an address")
    name = (match[1] or "CIO").upper().replace(" ", "")
    if name.startswith("E") or name == "DM":
        name = "D" if name == "DM" else name[:2]
    bit = whole_number(match[5]) if match[5] is not None else None
    return check_address(Address(name, whole_number(match[4]), bit))


def _portable(match: re.Match[str], areas: Mapping[str, Area], words: bool) -> Address:
    area, letter = match[1].upper(), match[2].upper() or "X"
    size = _SIZES[letter]
    if area not in areas:
        area = f"%{area}{letter}"
    if size == 1:
        if match[4] is None and match[2] == "":
            raise AddressError(f"%{match[1]}{match[3]} has no size: write %{match[1]}X{match[3]}.0 or %{match[1]}W{match[3]}")
        number, bit = whole_number(match[3]), whole_number(match[4] or "0")
        if words and bit > 15:
            raise AddressError(f"bit {bit} does not exist; bits of a word are 0 to 15")
        return check_address(Address(area, 2 * number + bit // 8, bit % 8, 1) if words else Address(area, number, bit, 1), areas)
    whole = check_address(Address(area, whole_number(match[3]), None, size), areas)
    if match[4] is None:
        return whole
    bit = whole_number(match[4])
    if bit >= size:
        raise AddressError(f"bit {bit} does not exist; bits of {whole} are 0 to {size - 1}")
    return Address(area, whole.byte_offset() + bit // 8, bit % 8, 1)


def check_address(address: Address, areas: Mapping[str, Area] = AREAS) -> Address:
    """The same address.  Raises AddressError if it lies outside its area."""
    if address.area in areas:
        area = areas[address.area]
    elif address.area in E_NAMES:
        area = e_bank(address.area, 0)
    elif address.area in PORTABLE_AREAS:
        raise AddressError(f"the program names no address such as {address}, and each size of address has memory of its own here")
    else:
        raise AddressError(f"there is no E bank {address.area[1:]}; banks are 0 to {E_BANKS - 1:X}")
    if area.unit_bits == 1 and address.bit is not None:
        raise AddressError(f"{address} is a flag and has no bits")
    top = 7 if area.unit_bits == 8 else 15
    if address.bit is not None and not 0 <= address.bit <= top:
        raise AddressError(f"bit {address.bit} does not exist; bits are 0 to {top}")
    size = max(1, address.size_bits // 8) if area.unit_bits == 8 else 1
    step = size if address.bit is None else 1
    if address.number < 0 or (address.number + 1) * step > area.count:
        shown = f"%{area.name}" if area.name in SHARED_AREAS else area.name
        raise AddressError(f"{shown} ends at {area.count // step - 1}; {address.number} does not exist")
    return address
