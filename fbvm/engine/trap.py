"""Traps: what an engine returns when a program was stopped, and the wording of their messages."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from fbvm.base.arithmetic import limits
from fbvm.base.codes import CODES
from fbvm.base.memory import OBJECT_SHIFT, Memory
from fbvm.base.types import DAY_NS
from fbvm.code.image import Image, Objects, Site
from fbvm.code.operations import LEASE_BYTES, LEASED

NO_INSTANCE = -1
"""In place of the offset of an instance: a function has none."""


@dataclass(frozen=True)
class Trap:
    """Why the program of a PLC was stopped in a scan.  Memory has what was stored before."""

    code: str
    """The code of a trap, such as "R0101"; `fbvm explain R0101` shows its page."""
    site: Site
    """The statement or expression that was being executed: file, POU, line and column."""
    values: tuple[Any, ...]
    """The values that caused it, in the order of the message, such as index, lower and upper bound."""
    message: str
    """Code, values in words and place, in one line."""
    instance: int = NO_INSTANCE
    """Byte of the memory at which the instance begins whose body was executed; NO_INSTANCE in a function."""

    def __str__(self) -> str:
        return self.message

    def told(self, path: Callable[[int], str]) -> str:
        """The message, with the name of the instance if that is not the name of its POU.

        `path` gives the name of what begins at a byte of the memory."""
        instance = path(self.instance) if self.instance != NO_INSTANCE else ""
        return f"{self} (in {instance})" if instance not in ("", self.site.pou) else str(self)


class Stop(Exception):
    """Raised inside an engine and turned into a Trap at its surface; `site` is a number of Image.sites."""

    def __init__(self, code: str, site: int, *values: Any) -> None:
        super().__init__(code, site, *values)
        self.code, self.site, self.values = code, site, values


_WORDS = {
    "R0101": "{0} divided by {1}",
    "R0102": "index {0} outside {1}..{2}",
    "R0103": "value {0} outside {1}..{2}",
    "R0106": "shift or rotate by {0}",
    "R0107": "selector {0} of MUX outside 0..{1}",
    "R0108": "string position or length {0} out of range",
    "R0112": "the scan took longer than the watch cycle time of {0} ms",
    "R0111": "text {0!r} cannot be converted to {1}",
}
_RAISED = "R0122"
ENDLESS = "a loop waits for what does not change within a scan, or there is too much work for one"
"""The usual causes of R0104."""
_CONVERSION = {1: "{0} has no such form", 2: "{0!r} does not fit {1}", 3: "{0} outside {1}..{2}"}
"""R0105 by the number of its values: BCD, text and data type, value and limits."""
_TICKS = {"ns": 1, "ms": 1_000_000, "s": 1_000_000_000}
_UNITS = {highest // tick: unit for highest in (limits("i64")[1], DAY_NS - 1) for unit, tick in _TICKS.items()}
"""By the greatest number that a conversion to a duration, date or time of day takes, the unit in which it counts."""
SHOWN_CHARACTERS = 60
"""Characters of a text in a message, which is one line: texts may have 65,534."""


def trap(image: Image, code: str, site: int, values: tuple[Any, ...] = (), instance: int = NO_INSTANCE,
         memory: Memory | None = None) -> Trap:
    """The trap `code` at the site with number `site` of the image.

    Its message says the values; without values it says the title of the code.  `instance` is that of `Trap`, `memory` the one in
    which the program was stopped."""
    place = image.sites[site]
    values = tuple(int(value) if isinstance(value, bool) else value for value in values)
    if code == "R0105" and values:
        words = _CONVERSION[len(values)].format(*map(_shown, values)) + _unit(values)
    elif code in _WORDS and values:
        words = _WORDS[code].format(*map(_shown, values))
    elif code == _RAISED:
        words = f"the program has raised exception 16#{values[0]:X}"
    elif code == "R0104":
        words = f"{CODES[code].title}: {ENDLESS}"
    elif code == "R0110" and values and memory is not None and image.objects.is_made(values[0] >> OBJECT_SHIFT):
        words = _of_heap(image.objects, values[0], memory)
    else:
        words = CODES[code].title if code in CODES else code
    return Trap(code, place, values, f"{code} {place}: {words}", instance)


def _unit(values: tuple[Any, ...]) -> str:
    """The unit of the numbers of an R0105 about times and dates: of whole numbers only those have limits.  A sum with a date has
    one limit of the 64 bits and another that depends on the summand."""
    if len(values) != 3 or not isinstance(values[0], int):
        return ""
    unit = _UNITS.get(values[2]) or _UNITS.get(-values[1] - 1)
    return f" {unit}" if unit else ""


def _of_heap(objects: Objects, reference: int, memory: Memory) -> str:
    """What is wrong with a pointer to what __NEW has made."""
    row, held = divmod((reference >> OBJECT_SHIFT) - LEASED, 1 << objects.held_bits)
    start, end, holder, _ = memory.views["u32"][(objects.leases_at + row * LEASE_BYTES) // 4:][:LEASE_BYTES // 4]
    if held != holder:
        return "what the pointer points at has been deleted by __DELETE"
    return f"this leads out of the {end - start} bytes that __NEW has made"


def _shown(value: Any) -> Any:
    """A value for a message; of a long text the beginning."""
    text = value.decode("latin-1") if isinstance(value, bytes) else value
    return f"{text[:SHOWN_CHARACTERS]}..." if isinstance(text, str) and len(text) > SHOWN_CHARACTERS else text


def too_long(ended: Trap, watch_ns: int) -> Trap:
    """The trap of a scan that took longer than the watch cycle time, from the one of the step budget that has ended it."""
    values = (watch_ns // 1_000_000,)
    return replace(ended, code="R0112", values=values, message=f"R0112 {ended.site}: {_WORDS['R0112'].format(*values)}")
