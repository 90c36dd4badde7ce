"""Words of a slot of a mailbox port: one TCP connection that a program wishes for and the unit brings about.

The interface is this project's own, for ports of vendors who document none.  The program says what it wishes, the unit
says how far it is; whoever writes a word stands behind it.  Bytes lie two in a word, the first in its high half.
"""

from __future__ import annotations

from enum import IntEnum

OWNER = 0  # program: which instance has claimed the slot; 0: free.  The unit does not care.
MODULE = 1  # program: number of the unit that is to serve it; 0: none
WISH = 2  # program
STATE = 3  # unit
ERROR = 4  # unit: number of the error in state FAILED, by the unit's own table
REMOTE_IP = 5  # program, two words; 0.0.0.0 fits anybody when listening
REMOTE_PORT = 7  # program; 0 fits anybody when listening
LOCAL_PORT = 8  # program; 0: the network chooses
PEER_IP = 9  # unit, two words: who is at the other end
PEER_PORT = 11  # unit
SENDING = 12  # program: bytes of OUTGOING to be sent; unit: 0 when it has taken them, which it does one by one
RECEIVED = 13  # unit: adds bytes to INCOMING; program: takes them away
OPTIONS = 14  # program
NOTE = 15  # program, for itself
OUTGOING, OUTGOING_BYTES = 16, 264  # program
INCOMING, INCOMING_BYTES = 148, 504  # unit
SLOT_WORDS = 400

KEEP_ALIVE = 1 << 0  # in OPTIONS


class Wish(IntEnum):
    """What the program wants of a connection.  After FAILED it has to want CLOSED before anything else is done."""

    CLOSED = 0
    CONNECT = 1
    LISTEN = 2
    RESET = 3
    """Closed by RST."""


class State(IntEnum):
    """How far a connection is."""

    CLOSED = 0
    OPENING = 1
    OPEN = 2
    ENDED = 3
    """The other end will say nothing more; what it said may be taken, and something be sent."""
    FAILED = 4
    CLOSING = 5
