"""Files to text: encodings are recognised, and what is no text at all is refused with a diagnostic."""

from __future__ import annotations

import codecs
from pathlib import Path

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.base.files import SOURCE_BYTES, read_file, reason

MARKS = ((codecs.BOM_UTF8, "utf-8"), (codecs.BOM_UTF16_LE, "utf-16-le"), (codecs.BOM_UTF16_BE, "utf-16-be"))
"""What texts of these encodings may begin with."""
_CONTROLS = frozenset(range(32)) - frozenset(b"\t\n\r\f\v\x1a")


def read(path: Path, name: str, library: str = "", most_bytes: int = SOURCE_BYTES) -> Source | Diagnostic:
    """The text of a file as a Source called `name`, or the diagnostic S0107 that says why there is none.

    UTF-8 with or without mark, UTF-16 with mark; what is neither is taken as Windows-1252, as older tools write it."""
    try:
        data = read_file(path, most_bytes)
    except OSError as error:
        return refusal(name, reason(error))
    return decode(data, name, library)


def decode(data: bytes, name: str, library: str = "") -> Source | Diagnostic:
    """The same for bytes already read."""
    for mark, encoding in MARKS:
        if data.startswith(mark):
            try:
                return Source(name, data[len(mark):].decode(encoding), library)
            except UnicodeDecodeError as error:
                return refusal(name, f"it begins as {encoding.upper()} and is none at byte {len(mark) + error.start}")
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        text = _older(data)
    if not _CONTROLS.isdisjoint(data):
        at = next(i for i, byte in enumerate(data) if byte in _CONTROLS)
        return refusal(name, f"byte {at} is 16#{data[at]:02X}, which no text contains; it looks like a binary file")
    return Source(name, text, library)


def _older(data: bytes) -> str:
    """Windows-1252, or Latin-1 where that has no character."""
    try:
        return data.decode("cp1252")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def refusal(name: str, why: str) -> Diagnostic:
    """The diagnostic for a file that cannot be read."""
    return Diagnostic("S0107", Source(name, ""), 0, 0, f"{name} cannot be read: {why}",
                      "a source is a text file in UTF-8, UTF-16 with a mark, or Windows-1252")
