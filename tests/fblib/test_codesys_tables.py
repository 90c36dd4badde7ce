"""Numbers, structures and lengths of texts of CODESYS's libraries, by the vendor's pages, and of the sockets of Windows."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

from rows import each_of

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc


@cache
def image_of(text: str, dialect: str) -> Image:
    made = compile_text(f"PROGRAM Main\n{text}\nEND_PROGRAM", dialect=dialect)
    assert made.image is not None, [message.render() for message in made.diagnostics]
    return made.image


def values_of(expressions: list[str], type: str, dialect: str, declared: str = "") -> list[Any]:
    """What expressions of a type are in a scan of a program with more variables `declared`."""
    rows = "\n".join(f"v[{at}] := {expression};" for at, expression in enumerate(expressions))
    plc = Plc(image_of(f"VAR v : ARRAY[0..{len(expressions) - 1}] OF {type}; {declared} END_VAR\n{rows}", dialect))
    assert plc.scan() is None
    return list(plc.read("Main.v"))


# --- numbers ------------------------------------------------------------------------------------------------------------

EXCEPTIONS = {
    0x0: "NOEXCEPTION",
    0x10: "WATCHDOG HARDWAREWATCHDOG IO_CONFIG_ERROR PROGRAMCHECKSUM FIELDBUS_ERROR IOUPDATE_ERROR CYCLE_TIME_EXCEED "
          "ONLCHANGE_PROGRAM_EXCEEDED UNRESOLVED_EXTREFS DOWNLOAD_REJECTED BOOTPROJECT_REJECTED_DUE_RETAIN_ERROR "
          "LOADBOOTPROJECT_FAILED OUT_OF_MEMORY RETAIN_MEMORY_ERROR BOOTPROJECT_CRASH",
    0x21: "BOOTPROJECTTARGETMISMATCH SCHEDULEERROR FILE_CHECKSUM_ERR RETAIN_IDENTITY_MISMATCH IEC_TASK_CONFIG_ERROR "
          "APP_TARGET_MISMATCH",
    0x50: "ILLEGAL_INSTRUCTION ACCESS_VIOLATION PRIV_INSTRUCTION IN_PAGE_ERROR STACK_OVERFLOW INVALID_DISPOSITION INVALID_HANDLE "
          "GUARD_PAGE DOUBLE_FAULT INVALID_OPCODE",
    0x100: "MISALIGNMENT ARRAYBOUNDS DIVIDEBYZERO OVERFLOW NONCONTINUABLE PROCESSORLOAD_WATCHDOG",
    0x150: "FPU_ERROR FPU_DENORMAL_OPERAND FPU_DIVIDEBYZERO FPU_INEXACT_RESULT FPU_INVALID_OPERATION FPU_OVERFLOW "
           "FPU_STACK_CHECK FPU_UNDERFLOW",
    0x2000: "VENDOR_EXCEPTION_BASE", 0x10000: "USER_EXCEPTION_BASE", 0xFFFFFFFF: "UNKNOWN",
}  # fmt: skip
"""The names from a number on, one after the other."""


def test_exceptions_have_the_numbers_of_the_runtime_system() -> None:
    numbers = {f"RTSEXCPT_{name}": first + at for first, names in EXCEPTIONS.items() for at, name in enumerate(names.split())}
    found = values_of([f"__SYSTEM.ExceptionCode.{name}" for name in numbers], "UDINT", "codesys")
    assert dict(zip(numbers, found, strict=True)) == numbers


ERRORS = {
    0: "OK FAILED PARAMETER NOTINITIALIZED VERSION TIMEOUT NOBUFFER", 10: "PENDING NUMPENDING NOTIMPLEMENTED INVALIDID OVERFLOW "
    "BUFFERSIZE NO_OBJECT NOMEMORY DUPLICATE MEMORY_OVERWRITE INVALID_HANDLE",
}  # fmt: skip


def test_results_have_the_numbers_of_the_runtime_system() -> None:
    numbers = {f"ERR_{name}": first + at for first, names in ERRORS.items() for at, name in enumerate(names.split())}
    found = values_of([f"Errors.{name}" for name in numbers], "UDINT", "codesys")
    assert dict(zip(numbers, found, strict=True)) == numbers


def test_ways_to_open_a_file_have_the_numbers_of_the_runtime_system() -> None:
    ways = ["READ", "WRITE", "APPEND", "READ_PLUS", "WRITE_PLUS", "APPEND_PLUS"]
    assert values_of([f"ACCESS_MODE.AM_{way}" for way in ways], "DINT", "codesys") == [0, 1, 2, 3, 4, 5]


def controls(direction: int, number: int) -> int:
    """The command of a socket that passes an unsigned long, as Winsock's _IOR and _IOW make it: a signed number."""
    command = direction << 30 | 4 << 16 | ord("f") << 8 | number
    return command - (command >> 31 << 32)


SOCKETS = {
    "INVALID": -1, "AF_INET": 2, "STREAM": 1, "DGRAM": 2, "RAW": 3, "IPPROTO_IP": 0, "IPPROTO_TCP": 6, "IPPROTO_UDP": 17,
    "INADDR_ANY": 0, "SOL": 0xFFFF, "SO_REUSEADDR": 4, "SO_KEEPALIVE": 8, "SO_BROADCAST": 0x20, "TCP_NODELAY": 1,
    "FIONREAD": controls(1, 127), "FIONBIO": controls(2, 126), "FD_SETSIZE": 64,
}  # fmt: skip


def test_constants_of_sockets_are_those_of_windows_assumed() -> None:
    found = values_of([f"SOCKET_{name}" for name in SOCKETS], "DINT", "codesys2")
    assert dict(zip(SOCKETS, found, strict=True)) == SOCKETS


# --- sizes --------------------------------------------------------------------------------------------------------------


@each_of(("type", "bytes", "dialect"), [
    ("SOCKADDRESS", 2 + 2 + 4 + 8, "codesys2"), ("SOCKET_FD_SET", 4 + 64 * 4, "codesys2"), ("SOCKET_TIMEVAL", 8, "codesys2"),
    ("RTS_IEC_HANDLE", 8, "codesys"), ("RTS_IEC_RESULT", 4, "codesys"), ("RTS_IEC_SIZE", 4, "codesys"),
    ("SysFile_Store[1].Content", 128 * 1024, "codesys"), ("SysFile_Store[8].Name", 255 + 1, "codesys"),
])  # fmt: skip
def test_how_many_bytes_a_structure_has(type: str, bytes: int, dialect: str) -> None:
    assert values_of([f"SIZEOF({type})"], "DINT", dialect) == [bytes]


@each_of(("array", "bounds", "dialect"), [
    ("a.sin_zero", [0, 7], "codesys2"), ("f.fd_array", [0, 63], "codesys2"),
    ("SysFile_Store", [1, 8], "codesys2"), ("SysFile_Store[8].Content", [0, 128 * 1024 - 1], "codesys2"),
])  # fmt: skip
def test_from_where_to_where_an_array_goes(array: str, bounds: list[int], dialect: str) -> None:
    expressions = [f"LOWER_BOUND({array}, 1)", f"UPPER_BOUND({array}, 1)"]
    assert values_of(expressions, "DINT", dialect, "a : SOCKADDRESS; f : SOCKET_FD_SET;") == bounds


@each_of(("call", "texts", "dialect"), [
    *((call, ["WSTRING[255]"] * count, "codesys") for call, count in (
        ("n := WCONCAT(1, 1)", 3), ("n := WDELETE(1, 1, 1)", 2), ("n := WFIND(1, 1)", 2), ("n := WINSERT(1, 1, 1)", 3),
        ("n := WLEFT(1, 1)", 2), ("n := WLEN(1)", 1), ("n := WMID(1, 1, 1)", 2), ("n := WREPLACE(1, 1, 1, 1)", 3),
        ("n := WRIGHT(1, 1)", 2))),
    ("n := WORD_AS_STRING(1, TRUE)", ["STRING[2]"], "codesys"), ("SysFileOpen(1, AM_READ, 0)", ["STRING[255]"], "codesys"),
    ("SysFileDelete(1)", ["STRING[255]"], "codesys"), ("SysFile_Find(1)", ["STRING[255]"], "codesys"),
    ("SysFileOpen(1, 1)", ["STRING[255]", "STRING[80]"], "codesys2"), ("SysFileDelete(1)", ["STRING[255]"], "codesys2"),
    ("SysFileGetSize(1)", ["STRING[255]"], "codesys2"),
])  # fmt: skip
def test_how_long_the_texts_are_that_a_function_takes_and_gives(call: str, texts: list[str], dialect: str) -> None:
    """A number is passed for each text, and the text that it gives is assigned to a number: what is needed is told."""
    errors = compile_text(f"PROGRAM Main VAR n : INT; END_VAR {call}; END_PROGRAM", dialect=dialect).errors
    assert sorted(re.findall(r"W?STRING\[\d+\]", " ".join(error.message for error in errors))) == sorted(texts)
