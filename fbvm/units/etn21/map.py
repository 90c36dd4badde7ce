"""Where an ETN21 keeps its words: the 25 CIO words from n and the 100 D words from m, as tables of offsets.

Knows positions only, no behaviour.  From W420 4-1, 4-2 and W421 6-6, 6-7.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

SOCKETS = range(1, 9)
AREAS = range(1, 9)
UNIT_NUMBERS = range(16)
CONNECTIONS = range(1, 17)  # of FINS/TCP, W420 3-2

# --- offsets from n (CIO), W420 4-1 p80-85, W421 6-6 p111 ------------------------------------------------------------
UDP_STATUS = 0  # + socket number: n+1..n+8
TCP_STATUS = 8  # + socket number: n+9..n+16
SERVICE_STATUS = 17
ERROR_STATUS = 18
SWITCHES = 19  # n+19..n+22, two areas a word
FINS_TCP_STATUS = 23
CIO_WORDS = 24
"""That the unit exchanges, from n on."""

FORCE_CLOSE = 1 << 2  # of word n, W421 6-7-5 p120
LINK_UP = 1 << 14  # of n+17; the bit's number is assumed
DISAGREEMENT = 1 << 14  # of n+18: host part of the address and FINS node, W420 4-1 p84

# --- A words of the CPU unit, bit N for the CPU bus unit with number N, [K] ---------------------------------------------
INITIALIZING = 302
RESTART = 501

# --- offsets from m (D), W420 4-2 p88 --------------------------------------------------------------------------------
BYTES_RECEIVED = 0  # + socket number: m+1..m+8
TCP_STATE = 8  # + socket number: m+9..m+16
PARAMETERS = 18  # area k from m + 18 + 10 * (k - 1)
PARAMETERS_LENGTH = 10
D_WORDS = 98
"""That the unit exchanges, from m on."""
LOCAL_IP = 98  # m+98, m+99, [K]

# --- offsets in a parameter area, W421 6-7-4 p117 --------------------------------------------------------------------
OPTION_AND_SOCKET, LOCAL_PORT, REMOTE_HOST, REMOTE_PORT, COUNT, DATA_ADDRESS, TIMEOUT, RESPONSE = 0, 1, 2, 4, 5, 6, 8, 9

OPEN = 1 << 15  # of a socket's status word, W420 4-1 p80-82


class Switch(IntEnum):
    """A request switch; the value is its bit in the area's byte of n+19..n+22 (W420 4-1 p84)."""

    UDP_OPEN = 0
    PASSIVE_OPEN = 1
    ACTIVE_OPEN = 2
    SEND = 3
    RECEIVE = 4
    CLOSE = 5


class TcpState(IntEnum):
    """Connection state as m+9..m+16 show it (W421 6-6-2 p112)."""

    CLOSED = 0x0
    LISTEN = 0x1
    SYN_SENT = 0x2
    SYN_RECEIVED = 0x3
    ESTABLISHED = 0x4
    CLOSE_WAIT = 0x5
    FIN_WAIT_1 = 0x6
    CLOSING = 0x7
    LAST_ACK = 0x8
    FIN_WAIT_2 = 0x9
    TIME_WAIT = 0xA


@dataclass(frozen=True, slots=True)
class Layout:
    """First words of one unit: `n` in CIO, `m` in D (W421 6-7-1 p113), and its bit in words for all CPU bus units."""

    n: int
    m: int
    bit: int

    @classmethod
    def of(cls, unit_number: int) -> Layout:
        """The layout of unit 0..15; ValueError for another number."""
        if unit_number not in UNIT_NUMBERS:
            raise ValueError(f"unit number {unit_number} is not in 0..15")
        return cls(1500 + 25 * unit_number, 30000 + 100 * unit_number, unit_number)

    def parameters(self, area: int) -> int:
        """D address of parameter area 1..8."""
        return self.m + PARAMETERS + PARAMETERS_LENGTH * (area - 1)

    def switches(self, area: int) -> tuple[int, int]:
        """CIO address of the word with the area's request switches, and the bit number of its first switch."""
        return self.n + SWITCHES + (area - 1) // 2, 0 if area % 2 else 8

    def status(self, protocol: str, socket: int) -> int:
        """CIO address of a socket's status word."""
        return self.n + (TCP_STATUS if protocol == "TCP" else UDP_STATUS) + socket
