"""Types of option values; a wrong value is an error of usage with a message."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from importlib.util import find_spec
from ipaddress import IPv4Address

from click import BadParameter, Choice, Context, IntRange, Parameter, UsageError, option

from fbvm.base.digits import whole_number
from fbvm.machine.scan.watch_cycle import LONGEST_NS, SHORTEST_NS, USUAL_NS
from fbvm.watch.values import parse_time_ns, split_list
from fbvm.wire.link import Peer

CYCLE_NS = 10_000_000
"""Cycle of programs without a TASK if --cycle is not given."""


def moment_ns(value: str | int) -> int:
    """The nanoseconds of `10ms`, `1.5s`, `T#10ms` or `0s`.  Raises BadParameter, also for a negative time."""
    if isinstance(value, int):
        return value
    try:
        passed_ns = parse_time_ns(value)
    except ValueError as error:
        raise BadParameter(str(error)) from None
    if passed_ns < 0:
        raise BadParameter(f"{value} is not a time that can pass")
    return passed_ns


def time_ns(value: str | int) -> int:
    """As `moment_ns`.  Raises BadParameter for 0, too."""
    passed_ns = moment_ns(value)
    if not passed_ns and not isinstance(value, int):
        raise BadParameter(f"{value} is not a time that can pass")
    return passed_ns


def watch_cycle_ns(value: str | int) -> int:
    """The nanoseconds of a watch cycle time.  Raises BadParameter for one that a CPU unit does not take."""
    found = time_ns(value)
    if not SHORTEST_NS <= found <= LONGEST_NS:
        raise BadParameter(f"{value} is no watch cycle time: it is from 10ms to 40s")
    return found


watch_cycle_option = option("--watch-cycle", "watch_ns", type=watch_cycle_ns, default=USUAL_NS, metavar="TIME", show_default="1s",
                            help="With real connections: the longest time that a scan may take, from 10ms to 40s.")


def address(bind: str, option: str = "--bind") -> str:
    """The address that an option says.  Raises BadParameter if it is none."""
    try:
        return str(IPv4Address(bind))
    except ValueError:
        raise BadParameter(f"{option} {bind} is not an IPv4 address of this computer") from None


@dataclass(frozen=True)
class Setting:
    """NAME=VALUE@TIME; the value is text until the type of the variable is known."""

    name: str
    value: str
    at_ns: int
    time: str = ""

    def __str__(self) -> str:
        return f"{self.name}={self.value}" + (f"@{self.time}" if self.time else "")


def setting(value: str) -> Setting:
    """`NAME=VALUE` or `NAME=VALUE@TIME`."""
    name, sign, text = value.partition("=")
    if not sign or not name.strip() or not text.strip():
        raise BadParameter(f"{value!r} is not NAME=VALUE")
    at_ns, moment = 0, ""
    front, at, time = text.rpartition("@")
    if at and not text.rstrip().endswith(("'", '"')):
        try:
            at_ns = parse_time_ns(time)
        except ValueError as error:
            raise BadParameter(str(error)) from None
        if at_ns < 0:
            raise BadParameter(f"{value}: nothing is before power-on; a time from 0s on is wanted, not {time}")
        text, moment = front, time.strip()
    return Setting(name.strip(), text.strip(), at_ns, moment)


@dataclass(frozen=True)
class Mapping:
    """IP:PORT=HOST:PORT, or IP:PORT=peer, where `host` is None; `endpoint` is IP:PORT."""

    endpoint: Peer
    host: str | None
    port: int


def mapping(value: str) -> Mapping:
    """`IP:PORT=HOST:PORT` for real connections, `IP:PORT=peer` for a Modbus server in memory."""
    said, sign, real = value.partition("=")
    if not sign:
        raise BadParameter(f"{value!r} is not IP:PORT=HOST:PORT or IP:PORT=peer")
    ip, port = _endpoint(said)
    parts = ip.split(".")
    if len(parts) != 4 or not all(part.isdecimal() and whole_number(part) <= 255 for part in parts):
        raise BadParameter(f"{ip!r} is no IPv4 address; a program knows no names")
    if real.strip() == "peer":
        return Mapping(Peer(ip, port), None, 0)
    return Mapping(Peer(ip, port), *_endpoint(real))


@dataclass(frozen=True)
class Door:
    """[IP:PORT=][HOST:]PORT; `endpoint` None is the first at which the program waits, `host` None the address of --bind."""

    endpoint: Peer | None
    host: str | None
    port: int


def door(value: str) -> Door:
    """`1502`, `0.0.0.0:1502`, or `192.168.250.21:502=127.0.0.1:1502`."""
    said, sign, real = value.rpartition("=")
    endpoint = mapping(f"{said}=peer").endpoint if sign else None
    if real.strip().isdecimal():
        return Door(endpoint, None, _endpoint(f"-:{real.strip()}")[1])
    return Door(endpoint, *_endpoint(real))


bind_option = option("--bind", default="127.0.0.1", show_default=True, metavar="ADDRESS",
                     help="Address of this computer to listen on; 0.0.0.0 is all.")


cycle_option = option("--cycle", "cycle_ns", type=time_ns, default=CYCLE_NS, metavar="TIME", show_default="10ms",
                      help="Cycle of programs without a TASK, and how often the PLC scans.")
net_option = option("--net", type=Choice(["loop", "tcp"]), default="loop", show_default=True,
                    help="loop: in memory, virtual time.  tcp: real connections, real time.")
map_option = option("--map", "mappings", type=mapping, multiple=True, metavar="IP:PORT=HOST:PORT|peer",
                    help="Where an endpoint that the program names really is.")
door_option = option("--door", "doors", type=door, multiple=True, metavar="[IP:PORT=][HOST:]PORT",
                     help="Where others reach the program: its first port, or the one that is named.  Implies --net tcp.")


def _endpoint(text: str) -> tuple[str, int]:
    host, colon, port = text.strip().rpartition(":")
    if not colon or not host or not port.isdecimal() or whole_number(port) > 65535:
        raise BadParameter(f"{text!r} is not an address and a port such as 192.168.250.1:502")
    return host, whole_number(port)


def _shown(context: Context, parameter: Parameter, given: tuple[str, ...]) -> tuple[str, ...]:
    names = [split_names(text) for text in given]
    if not all(names):
        raise BadParameter("no name stands between the commas")
    return tuple(name for listed in names for name in listed)


show_option = option("--show", "shown", multiple=True, metavar="NAME|ADDRESS|FIRST..LAST,...", callback=_shown,
                           help="Print these at the end.")


def charted_names(options: Iterable[str]) -> list[str]:
    """The names that --chart options list.  Raises ValueError for one that lists none."""
    found = [split_names(text) for text in options]
    if not all(found):
        raise ValueError("--chart names nothing to draw: write --chart NAME,ADDRESS,...")
    return [name for names in found for name in names]


def split_names(text: str) -> list[str]:
    """The names of a list such as `Main.done,a[1,2],D5`; commas within brackets do not separate.

    >>> split_names("Main.done,a[1,2],D5")
    ['Main.done', 'a[1,2]', 'D5']
    """
    return [name for name in split_list(text) if name]


debug_option = option("--debug", "debug_port", type=IntRange(0, 65535), metavar="PORT",
                            help="Let an editor's debugger attach at this port; 0 is one that the system picks.")
live_option = option("--live", is_flag=True, help="Serve a page on which the PLC is seen and touched, until Ctrl-C; "
                                                        "`fbvm live` has more options.")  # fmt: skip


def check_live_installed() -> None:
    """Raises UsageError if the library of the live page is missing."""
    if find_spec("websockets") is None:
        raise UsageError("the live page needs websockets: pip install 'fbvm[live]'")
