"""The Ethernet module of a Schneider Quantum or M340, as the MBP_MSTR library meets it: a table.

It counts what passes and restarts when it is asked to.  HTTP and FTP are states of services that nobody serves.  The layout of
the mailbox is this project's own.  The statistics table, module types and board status are those of the Control Expert help
(CONTROL parameter of MBP_MSTR for Modbus TCP), the errors those of the module's BSD stack (840 USE 115 00 pp. 25-40), of which
only the numbers that all its generations share are used."""

from __future__ import annotations

import re
from dataclasses import KW_ONLY, dataclass, field
from enum import IntEnum

from fbvm.units.port.unit import MailboxUnit, Restart, Table, Traffic

RESTART_NS = 5_000_000_000
"""How long a restart takes, unless somebody says another time: assumed."""
RACK_SLOTS = range(17)
BUILT_IN = 254
"""What programs call the port that is built into the CPU; it comes behind the slots of the rack."""
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


class Statistic(IntEnum):
    """Words of the statistics table.  All between board status and IP are counters of 32 bits, the low word first."""

    MAC = 0
    BOARD = 3
    RECEIVER_INTERRUPTS = 4
    TRANSMITTER_INTERRUPTS = 6
    TRANSMIT_TIMEOUTS = 8
    DRIVER_RESTARTS = 16
    TRANSMIT_BUFFER_ERRORS = 26
    LOST_CARRIER = 32
    IP = 36


# bits of the board status, and where the type of the module stands in it
RUNNING, CONFIGURED, DUPLEX, FAST, LINK = 1 << 0, 1 << 1, 1 << 2, 1 << 12, 1 << 15
TYPE_SHIFT = 4
# bits of the words that say which services there are
FTP, HTTP = 1 << 0, 1 << 1


def _statistic(word: int) -> str:
    return f"Statistics[{word}]"


def _status(noc: Noc) -> str:
    return "restarting" if noc.is_restarting else "ready" if noc.configured else "unconfigured"


def _board(noc: Noc) -> int:
    running = RUNNING if noc.configured and not noc.is_restarting else 0
    return (FAST | DUPLEX | noc.module_type << TYPE_SHIFT | (LINK if noc.link_up else 0)
            | (CONFIGURED if noc.configured else 0) | running)  # fmt: skip


def _services(noc: Noc) -> int:
    return (FTP if noc.ftp else 0) | (HTTP if noc.http else 0)


def _mac(noc: Noc) -> tuple[int, ...]:
    octets = re.sub("[:-]", "", noc.mac)
    return tuple(int(octets[first : first + 4], 16) for first in (0, 4, 8))


def _received(noc: Noc, traffic: Traffic) -> int:
    """Counts a refused connection, too, and one that was reset."""
    if not traffic.errors:
        return traffic.received
    return traffic.received + traffic.errors.count("ECONNRESET") + traffic.errors.count("ECONNREFUSED")


@dataclass(eq=False)
class Noc(MailboxUnit):
    """A module in `rack_slot` (0 to 16, or 254 for the port of the CPU itself).

    `module_type` is a number of `MODULE_TYPES`; `http` and `ftp` say whether the services are configured.
    Raises ValueError for a wrong argument."""

    rack_slot: int = 7
    address: str = "192.168.250.22"
    _: KW_ONLY
    mac: str = "00:00:54:00:12:34"
    module_type: int = 14
    http: bool = True
    ftp: bool = True
    restart_ns: int = RESTART_NS
    link_up: bool = field(default=True, init=False)
    """Whether the board status says that the cable is plugged; what the network does is the network's affair."""
    configured: bool = field(default=True, init=False)
    """Whether the module has its configuration."""

    table = Table(
        name="NOC {unit.rack_slot}",
        area="NOC",
        block="MBP_MSTR",
        lines="MSTR_Lines",
        number=lambda noc: 1 + (len(RACK_SLOTS) if noc.rack_slot == BUILT_IN else noc.rack_slot),
        head="MSTR_Modules[{number}]",
        begins={
            "Rack_Slot": lambda noc: noc.rack_slot,
            "Configured": _services,
            "Services": _services,
            "IP": lambda noc: noc.own_ip,
            _statistic(Statistic.MAC): _mac,
            _statistic(Statistic.IP): lambda noc: noc.own_ip[::-1],
        },
        shows={"Status": _status, _statistic(Statistic.BOARD): _board},
        counts={
            _statistic(Statistic.RECEIVER_INTERRUPTS): _received,
            _statistic(Statistic.TRANSMITTER_INTERRUPTS): lambda noc, traffic: traffic.sent,
            _statistic(Statistic.TRANSMIT_TIMEOUTS): lambda noc, traffic: traffic.errors.count("ETIMEDOUT"),
            _statistic(Statistic.TRANSMIT_BUFFER_ERRORS): lambda noc, traffic: traffic.errors.count("ENOBUFS"),
            _statistic(Statistic.LOST_CARRIER): lambda noc, traffic: 0 if noc.link_up else traffic.sent,
        },
        counters=[_statistic(word) for word in range(Statistic.RECEIVER_INTERRUPTS, Statistic.IP, 2)],
        restart=Restart(
            asked="Restart",
            count=_statistic(Statistic.DRIVER_RESTARTS),
            restores={"Services": _services},
            lasts_ns=lambda noc: noc.restart_ns,
        ),
        serves=lambda noc: noc.configured and not noc.is_restarting,
        errors=ERRNO,
        other_error=ERRNO["EIO"],  # assumed
        settings={"slot": lambda noc: str(noc.rack_slot), "module": lambda noc: MODULE_TYPES[noc.module_type],
                  "MAC": lambda noc: noc.mac},
        lamps={"RUN": (_statistic(Statistic.BOARD), RUNNING), "LINK": (_statistic(Statistic.BOARD), LINK),
               "100 MB": (_statistic(Statistic.BOARD), FAST)},
        told={"received": _statistic(Statistic.RECEIVER_INTERRUPTS), "sent": _statistic(Statistic.TRANSMITTER_INTERRUPTS),
              "timed out": _statistic(Statistic.TRANSMIT_TIMEOUTS), "restarts": _statistic(Statistic.DRIVER_RESTARTS)},
        refusals=[
            (lambda noc: noc.module_type not in MODULE_TYPES, "there is no module of type {unit.module_type}"),
            (lambda noc: not re.fullmatch(r"[0-9A-Fa-f]{2}([:-][0-9A-Fa-f]{2}){5}", noc.mac),
             "{unit.mac!r} is not six bytes in hexadecimal, parted by colons"),
            (lambda noc: noc.rack_slot not in (*RACK_SLOTS, BUILT_IN),
             f"a module is in slot 0 to {RACK_SLOTS[-1]} of the rack, or {BUILT_IN} within the CPU; not {{unit.rack_slot}}"),
        ],
    )  # fmt: skip
