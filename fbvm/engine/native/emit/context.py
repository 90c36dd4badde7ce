"""The context: the bytes beside a PLC's memory in which native code keeps what is no part of its state.

From where code looks at it, its fields come first and then scratch bytes for the texts of one statement; in front of them
lie the texts of temporaries.  Nothing in it is kept between scans."""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Iterable, Iterator
from typing import Any

from fbvm.base.arithmetic import NAN
from fbvm.base.memory import STRUCTS
from fbvm.engine.native.library.reading import CLEANED

FIELDS = {"size": 0, "values": 8, "result": 32, "f32": 40, "f64": 48, "stops": 56}
"""Where its 64-bit fields lie: size of the memory, up to three values of a trap, a second result of a routine or the
instance of a trap, the canonical NaN of each float type (out of LLVM's sight, which holds one NaN for as good as another),
the table of `stops`."""
DIGITS = FIELDS["result"] + CLEANED
"""Where routines of the library write the text of a number before they read the number."""
SCRATCH = 512
"""Where the scratch bytes of texts begin; statements use them in turn."""

Shown = tuple[str, Any]
"""How a trap tells one value: (machine type, None) or ("text", None) as found in the context, ("const", value); and, last
of all, whose code it was: (INSTANCE, offset), or None if that is found in the context."""
INSTANCE = "instance"
Point = tuple[str, int, tuple[Shown, ...]]
"""A point at which a run can end: code, site, values."""


class Context:
    """The context of one PLC: `at` is the address of its fields in the host, `read` looks at what a trap left there."""

    def __init__(self, kept_bytes: int, context_bytes: int, memory_bytes: int, stops_at: int = 0) -> None:
        self._content = bytearray(kept_bytes + context_bytes)
        self._start = kept_bytes
        self._place = (ctypes.c_char * len(self._content)).from_buffer(self._content)
        self.at = ctypes.addressof(self._place) + kept_bytes
        self._put("<q", "size", memory_bytes)
        self._put("<q", "stops", stops_at)
        self._put("<f", "f32", NAN)
        self._put("<d", "f64", NAN)

    def _put(self, form: str, field: str, value: float) -> None:
        struct.pack_into(form, self._content, self._start + FIELDS[field], value)

    def values(self, shown: Iterable[Shown]) -> Iterator[Any]:
        """The values of a trap: a float as LREAL, an integer of 64 bits with its sign or without, bytes of a text."""
        at = self._start + FIELDS["values"]
        for kind, constant in shown:
            if kind == INSTANCE:
                return
            if kind == "const":
                yield constant
            elif kind == "text":
                yield ctypes.string_at(*struct.unpack_from("<qq", self._content, at))
                at += 16
            else:
                form = "f64" if kind[0] == "f" else "i64" if kind[0] == "i" else "u64"
                yield STRUCTS[form].unpack_from(self._content, at)[0]
                at += 8

    def instance(self, shown: tuple[Shown, ...]) -> int:
        """Where the instance begins whose body a trap has ended."""
        given: int | None = dict(shown).get(INSTANCE)
        at = self._start + FIELDS["result"]
        return int(STRUCTS["i64"].unpack_from(self._content, at)[0]) if given is None else given
