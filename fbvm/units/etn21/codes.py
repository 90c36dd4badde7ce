"""Response codes of the ETN21's socket services, as values for word +9 of a parameter area.

A code above 00FF comes from checking a request, 0001..007F is the errno of the unit's BSD-like stack, 0080..0082 come
from processing.  From W421 6-7-6 p120-125, W343 6-2-2 p118, W420 8-6 p227.
"""

from __future__ import annotations

NORMAL_END = 0x0000
TIMED_OUT = 0x0080
SOCKET_CLOSED = 0x0081
LOCAL_ADDRESS_ERROR = 0x0105
CPU_UNIT_ERROR = 0x0302
PARAMETER_RANGE = 0x1100
AREA_CODE = 0x1101
BIT_NUMBER = 0x1103
OTHER_PROCESSING = 0x110C
ALREADY_OPEN = 0x220F
NOT_OPEN = 0x2210
UNIT_BUSY = 0x2211
OTHER_PROTOCOL = 0x2606
OTHER_SOCKET = 0x2607

MEANING = {
    NORMAL_END: "normal end",
    TIMED_OUT: "the time set in the parameter area ran out",
    SOCKET_CLOSED: "the socket was closed while this service ran",
    0x0066: "no internal memory can be had",
    0x0082: "no connection with the specified peer",
    LOCAL_ADDRESS_ERROR: "local IP address setting error",
    CPU_UNIT_ERROR: "CPU Unit error, cannot execute",
    PARAMETER_RANGE: "parameter out of range",
    AREA_CODE: "area of the data address not allowed",
    BIT_NUMBER: "bit number of the data address is not 00",
    OTHER_PROCESSING: "switch turned ON during other processing",
    ALREADY_OPEN: "already open or opening, or the same service is running",
    NOT_OPEN: "socket not open",
    UNIT_BUSY: "unit busy",
    OTHER_PROTOCOL: "socket number is open with the other protocol",
    OTHER_SOCKET: "parameter area is bound to another socket",
}
"""What the codes of checking and processing say; those of `ERRNO` speak for themselves."""

ERRNO = {  # W420 8-6 p227, W343 10-7 p210
    "ESRCH": 0x03,
    "ENXIO": 0x06,
    "EBADF": 0x09,
    "EACCES": 0x0D,
    "EFAULT": 0x0E,
    "EEXIST": 0x11,
    "EINVAL": 0x16,
    "EMFILE": 0x18,
    "EPIPE": 0x20,
    "EPROTONOSUPPORT": 0x3C,
    "EPROTOTYPE": 0x3D,
    "ENOBUFS": 0x3E,
    "ENOMEM": 0x3E,
    "EISCONN": 0x3F,
    "ENOTCONN": 0x40,
    "EALREADY": 0x41,
    "EMSGSIZE": 0x42,
    "ENOPROTOOPT": 0x44,
    "ECONNABORTED": 0x45,
    "EADDRINUSE": 0x49,
    "ECONNREFUSED": 0x4A,
    "ECONNRESET": 0x4B,
    "EADDRNOTAVAIL": 0x4C,
    "ENETUNREACH": 0x4E,
    "EHOSTDOWN": 0x4F,
    "EHOSTUNREACH": 0x51,
    "ETIMEDOUT": 0x53,
}


def code_of(errno_name: str) -> int:
    """The response code for a POSIX errno name; 0045 (aborted, assumed) for one that the unit's table lacks."""
    return ERRNO.get(errno_name, ERRNO["ECONNABORTED"])


def meaning_of(code: int) -> str:
    """A few words about a response code, for charts and messages."""
    if code in MEANING:
        return MEANING[code]
    return next((name for name, value in ERRNO.items() if value == code), "unknown code")
