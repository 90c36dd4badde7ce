"""Projects and libraries of CODESYS 2.3 and TwinCAT 2: their exports as text (.EXP), and the files themselves (.lib, .pro), in
which declarations and Structured Text stand as they were written.  Sources are made of both; diagrams are not read."""

from __future__ import annotations

EXPORT_MARKS = (b"(* @NESTEDCOMMENTS := '", b"(* @SYMFILEFLAGS := '", b"(* @OBJECTFLAGS := '")
"""One of these stands in front of the first object of an export."""
BINARY_MARK = b"CoDeSys+"
"""How a project or library begins."""
BINARY_SUFFIXES = (".lib", ".pro")
HEAD_BYTES = 4_000


def is_export(data: bytes) -> bool:
    """Whether a file is an export as text."""
    return any(mark in data[:HEAD_BYTES] for mark in EXPORT_MARKS) and not data.startswith(BINARY_MARK)


def is_binary(data: bytes) -> bool:
    """Whether a file is a project or a library."""
    return data.startswith(BINARY_MARK)
