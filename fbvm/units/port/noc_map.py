"""Words, numbers and the statistics table of a Schneider Quantum/M340 Ethernet module, as its mailbox shows them.

The layout of the head is this project's own.  The statistics table, module types and board status are those of the
Control Expert help (CONTROL parameter of MBP_MSTR for Modbus TCP), the errors those of the module's BSD stack
(840 USE 115 00 pp. 25-40), of which only the numbers that all its generations share are used.
"""

from __future__ import annotations

AREA = "NOC"
PLACES = 18  # 0 to 16: slots of the rack; 17: the port built into the CPU, which programs name as slot 254
BUILT_IN = 254
HEAD_WORDS = 48  # for each place
SLOTS = 32

STATUS = 0
RACK_SLOT = 1
REQUEST = 2
CONFIGURED = 3  # services as configured
SERVICES = 4  # services as they are
OWN_IP = 5  # two words, the first octet in the high half of the first
STATISTICS = 8

# STATUS
ABSENT, READY, RESTARTING, UNCONFIGURED = range(4)
# REQUEST
RESTART = 1 << 0
# CONFIGURED and SERVICES
FTP = 1 << 0
HTTP = 1 << 1

# words of the statistics table; all but MAC, board status and IP are 32-bit counters, low word first
MAC = 0
BOARD = 3
COUNTERS = range(4, 36, 2)
RECEIVER_INTERRUPTS = 4
TRANSMITTER_INTERRUPTS = 6
TRANSMIT_TIMEOUTS = 8
DRIVER_RESTARTS = 16
TRANSMIT_BUFFER_ERRORS = 26
LOST_CARRIER = 32
IP = 36
TABLE_WORDS = 38

# bits of the board status
LINK, FAST, DUPLEX, CONFIGURED_BIT, RUNNING = 1 << 15, 1 << 12, 1 << 2, 1 << 1, 1 << 0
TYPE_SHIFT = 4
MODULE_TYPES = {
    0: "NOE 2x1", 1: "ENT", 2: "M1E", 3: "NOE 771 00", 4: "ETY", 5: "CIP", 7: "140 CPU 651 x0", 8: "140 CRP 312 00",
    10: "140 NOE 771 10", 11: "140 NOE 771 01", 12: "140 NOE 771 11", 14: "140 NOC 78x 00", 17: "M340 CPU",
    18: "M340 NOE", 19: "BMX NOC 0401", 20: "TSX ETC 101", 21: "140 NOC 771 01",
}  # fmt: skip

ERRNO = {
    "EINTR": 0x04, "EIO": 0x05, "ENXIO": 0x06, "EBADF": 0x09, "ENOMEM": 0x0C, "EACCES": 0x0D, "EEXIST": 0x11,
    "EINVAL": 0x16, "EPIPE": 0x20, "EADDRINUSE": 0x30, "EADDRNOTAVAIL": 0x31, "ENETUNREACH": 0x33, "ENETRESET": 0x34,
    "ECONNABORTED": 0x35, "ECONNRESET": 0x36, "ENOBUFS": 0x37, "EISCONN": 0x38, "ENOTCONN": 0x39, "ETIMEDOUT": 0x3C,
    "ECONNREFUSED": 0x3D, "EHOSTUNREACH": 0x41,
}  # fmt: skip


def number_of(errno_name: str) -> int:
    """The number of an error in the module's stack; 05, input or output error (assumed), for one that it lacks."""
    return ERRNO.get(errno_name, ERRNO["EIO"])


def place_of(rack_slot: int) -> int:
    """Which of the heads belongs to a slot of the rack.  Raises ValueError if there is no such slot."""
    if rack_slot == BUILT_IN:
        return PLACES - 1
    if not 0 <= rack_slot < PLACES - 1:
        raise ValueError(f"a module is in slot 0 to {PLACES - 2} of the rack, or {BUILT_IN} within the CPU; not {rack_slot}")
    return rack_slot
