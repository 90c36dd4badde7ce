"""Commands and end codes of FINS by number, and what they are called.

Commands: W342 5-3 p202-203; those of units W420 7-3 and W343 p102.  End codes: W342 5-1-3 p155, W420 8-5 p223-225, W343 10-6,
W465 14-6 p373; those in none of these are called as public programs agree (wireshark, omron-fins).
"""

from __future__ import annotations

from enum import IntEnum

COMMANDS: dict[int, str] = {
    0x0101: "memory area read", 0x0102: "memory area write", 0x0103: "memory area fill", 0x0104: "multiple memory area read",
    0x0105: "memory area transfer", 0x0201: "parameter area read", 0x0202: "parameter area write",
    0x0203: "parameter area clear", 0x0306: "program area read", 0x0307: "program area write", 0x0308: "program area clear",
    0x0401: "run", 0x0402: "stop", 0x0403: "reset", 0x0501: "CPU unit data read", 0x0502: "connection data read",
    0x0601: "CPU unit status read", 0x0620: "cycle time read", 0x0701: "clock read", 0x0702: "clock write",
    0x0801: "internode echo test", 0x0802: "broadcast test results read", 0x0803: "broadcast test data send",
    0x0920: "message read or clear", 0x0C01: "access right acquire", 0x0C02: "access right forced acquire",
    0x0C03: "access right release", 0x2101: "error clear", 0x2102: "error log read", 0x2103: "error log clear",
    0x2140: "write access log read", 0x2141: "write access log clear", 0x2201: "file name read", 0x2202: "single file read",
    0x2203: "single file write", 0x2204: "file memory format", 0x2205: "file delete", 0x2207: "file copy",
    0x2208: "file name change", 0x220A: "memory area file transfer", 0x220B: "parameter area file transfer",
    0x220C: "program area file transfer", 0x2215: "directory create or delete", 0x2220: "file memory write",
    0x2301: "forced set or reset", 0x2302: "forced set or reset cancel", 0x2701: "UDP open request",
    0x2702: "UDP receive request", 0x2703: "UDP send request", 0x2704: "UDP close request", 0x2710: "TCP open passive request",
    0x2711: "TCP open active request", 0x2712: "TCP receive request", 0x2713: "TCP send request", 0x2714: "TCP close request",
    0x2720: "ping", 0x2730: "FINS/TCP connection remote node change", 0x2731: "FINS/TCP connection status read",
    0x2750: "IP address table write", 0x2760: "IP address table read", 0x2761: "IP router table read",
    0x2762: "protocol status read", 0x2763: "memory status read", 0x2764: "socket status read",
    0x2765: "address information read",
}  # fmt: skip
"""What each command is called."""


class EndCode(IntEnum):
    """The end codes that are given here."""

    NORMAL = 0x0000
    NOT_IN_NETWORK = 0x0101
    NO_UNIT = 0x0202
    BUSY = 0x0204
    TIMED_OUT = 0x0205
    UNDEFINED = 0x0401
    NOT_SUPPORTED = 0x0402
    NO_ROUTE = 0x0502
    TOO_LONG = 0x1001
    TOO_SHORT = 0x1002
    COUNT = 0x1003
    HEADER = 0x1005
    PARAMETER = 0x1100
    NO_AREA = 0x1101
    FIRST_ADDRESS = 0x1103
    ADDRESS_RANGE = 0x1104
    NO_PROGRAM = 0x1106
    RESPONSE_TOO_LONG = 0x110B
    OTHER_PARAMETER = 0x110C
    READ_ONLY = 0x2101
    PROTECTED = 0x2102
    CANNOT_CHANGE = 0x2108
    IN_PROGRAM = 0x2203
    IN_RUN = 0x2206
    CONNECTION_EXISTS = 0x2230
    NOT_A_CLIENT = 0x2231
    ACCESS_RIGHT = 0x3001


END_CODES: dict[int, str] = {
    0x0000: "normal end", 0x0001: "service cancelled", 0x0101: "the local node is not in the network",
    0x0102: "token time-out", 0x0103: "retries failed", 0x0104: "too many send frames", 0x0105: "node address out of range",
    0x0106: "node address used twice", 0x0201: "the destination node is not in the network", 0x0202: "no unit with this address",
    0x0203: "the third node is not in the network", 0x0204: "the destination is busy", 0x0205: "response time-out",
    0x0301: "communications controller error", 0x0302: "CPU unit error at the destination", 0x0303: "controller error",
    0x0304: "unit number error", 0x0401: "undefined command", 0x0402: "not supported by this model",
    0x0501: "the destination is not in the routing tables", 0x0502: "no routing tables", 0x0503: "routing table error",
    0x0504: "too many relays", 0x1001: "command too long", 0x1002: "command too short",
    0x1003: "number of elements and data differ", 0x1004: "command format error", 0x1005: "header error",
    0x1100: "parameter error", 0x1101: "no such area", 0x1102: "access size error", 0x1103: "first address not accessible",
    0x1104: "end of the address range exceeded", 0x1106: "no such program", 0x1109: "relation error",
    0x110A: "duplicate data access", 0x110B: "response too long", 0x110C: "parameter error", 0x2002: "protected",
    0x2003: "no table", 0x2004: "no data", 0x2005: "no program", 0x2006: "no file", 0x2007: "data mismatch",
    0x2101: "read only", 0x2102: "write-protected", 0x2103: "cannot be registered", 0x2105: "no program", 0x2106: "no file",
    0x2107: "the file exists", 0x2108: "cannot be changed", 0x2201: "not possible during execution",
    0x2202: "not possible while stopped", 0x2203: "the PLC is in PROGRAM mode", 0x2204: "the PLC is in DEBUG mode",
    0x2205: "the PLC is in MONITOR mode", 0x2206: "the PLC is in RUN mode", 0x2207: "not the polling node",
    0x2208: "the step cannot be executed", 0x220F: "the service is running", 0x2210: "not open", 0x2211: "busy",
    0x2230: "connection exists", 0x2231: "not a client", 0x2232: "aborted", 0x2240: "high-speed sockets are in use",
    0x2301: "no file device", 0x2302: "no memory", 0x2303: "no clock", 0x2401: "no data link table", 0x2502: "memory error",
    0x2503: "I/O setting error", 0x2504: "too many I/O points", 0x2505: "CPU bus error", 0x2506: "I/O duplication",
    0x2507: "I/O bus error", 0x2509: "unit error", 0x250A: "unit number twice", 0x2510: "no such unit", 0x2601: "no protection",
    0x2602: "wrong password", 0x2604: "protected", 0x2605: "the service is running", 0x2606: "the service is stopped",
    0x2607: "no execution right", 0x2608: "not ready", 0x2609: "setting error", 0x260A: "the message number is wrong",
    0x260B: "the error cannot be cleared", 0x3001: "another device has the access right", 0x4001: "aborted",
}  # fmt: skip
"""What each end code says."""
RELAY_ERROR, FATAL, NON_FATAL = 0x8000, 0x0080, 0x0040
"""Bits of an end code beside its number: an error on the way; a fatal and a non-fatal error of the answering CPU unit."""


def meaning_of(end_code: int) -> str:
    """A few words about an end code.

    >>> meaning_of(0x0040)
    'normal end, with a non-fatal error of the PLC'
    """
    number = end_code & ~(RELAY_ERROR | FATAL | NON_FATAL)
    said = END_CODES.get(number, f"end code {number:04X}")
    for bit, more in ((RELAY_ERROR, "on the way"), (FATAL, "with a fatal error of the PLC"),
                      (NON_FATAL, "with a non-fatal error of the PLC")):  # fmt: skip
        if end_code & bit:
            said += f", {more}"
    return said


def command_name(code: int) -> str:
    """What a command is called."""
    return COMMANDS.get(code, f"command {code:04X}")
