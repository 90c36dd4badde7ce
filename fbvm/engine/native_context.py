"""The context: the bytes beside a PLC's memory in which native code keeps what is no part of its state.

It holds the size of the memory, the values of a trap and scratch bytes for texts; nothing in it is kept between scans."""

from __future__ import annotations

import struct
from typing import Any

from fbvm.base.arithmetic import NAN

FIELDS = {"size": 0, "values": 8, "result": 32, "f32": 40, "f64": 48}
"""Where its 64-bit fields lie: size of the memory, up to three values of a trap, a second result of a routine, the
canonical NaN of each float type (out of LLVM's sight, which holds one NaN for as good as another)."""
DIGITS = 64
"""Where a number's text is cleaned before it is read."""
SCRATCH = 512
"""Where the scratch bytes of texts begin."""

Shown = tuple[str, Any]
"""How a trap tells one value: (machine type, None) or ("text", None) as found in the context, ("const", value)."""
Point = tuple[str, int, tuple[Shown, ...]]
"""A point at which a run can end: code, site, values."""


def new_context(size_bytes: int, memory_bytes: int) -> bytearray:
    """The context of a memory of that size."""
    context = bytearray(size_bytes)
    struct.pack_into("<q", context, FIELDS["size"], memory_bytes)
    struct.pack_into("<f", context, FIELDS["f32"], NAN)
    struct.pack_into("<d", context, FIELDS["f64"], NAN)
    return context
