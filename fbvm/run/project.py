"""The project file, `fbvm.toml`: PLCs with their units, what they talk to, what goes wrong and what is watched.

    [run]
    net = "loop"                        # in memory and virtual time; "tcp": real connections, real time
    for = "10s"

    [[server]]                          # a Modbus server in memory; with tcp it is at `host`
    address = "192.168.250.1:502"
    host = "127.0.0.1:15020"

    [plc.pump]
    sources = ["pump.st"]               # relative to the project file
    cycle = "100ms"
    count = 1000                        # pump[1] to pump[1000], with addresses from that of the unit on
    watch = ["Main.Done", "D200"]

    [[plc.pump.unit]]
    address = "192.168.250.21"
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from ipaddress import IPv4Address
from pathlib import Path
from typing import Any

from fbvm.base.diagnostics import Diagnostic, Source, errors
from fbvm.base.dialects import DIALECTS
from fbvm.base.files import SETTINGS_BYTES, resolved
from fbvm.base.host import foreign_path
from fbvm.code.image import LARGEST_HEAP
from fbvm.engine.choice.tiers import CHOICES
from fbvm.interchange.formats.given import usual_dialect
from fbvm.machine.backplane import KINDS as UNIT_KINDS
from fbvm.machine.scan.watch_cycle import LONGEST_NS, SHORTEST_NS, USUAL_NS
from fbvm.net.faults import Fault
from fbvm.run.fault_rows import FAULT, check_faults, fault_of, impossible_on_the_host
from fbvm.run.picture_rows import PICTURE, Picture, check_pictures, pictures_of
from fbvm.run.project_reader import (
    Key,
    Keys,
    Reading,
    anything,
    endpoint,
    flag,
    host,
    ip,
    moment_ns,
    one_of,
    one_or_more,
    text,
    texts,
    texts_by_name,
    time_between,
    time_ns,
    whole,
)
from fbvm.run.running import PACES
from fbvm.syntax.text import read
from fbvm.units.etn21.fins.state import ACCESS
from fbvm.wire.link import Peer

FILE = "fbvm.toml"
NETS = ("loop", "tcp")
MOST = 100_000
"""PLCs of one kind."""

LAST_PORT, MOST_ADDRESS = 65_535, 0xFFFF_FFFF
MOST_NAMED = 5
"""Files that a hint names."""
MOST_NUMBER = 1 << 62

RUN: Keys = {
    "net": Key(one_of(NETS), "The network: in memory with virtual time, or real connections with real time.", "loop"),
    "seed": Key(whole(0, MOST_NUMBER), "Where the random numbers of the network in memory begin.", 0),
    "for": Key(time_ns, "How long PLCs without an end of their own run.", None),
    "scans": Key(whole(0, MOST_NUMBER), "How many scans PLCs without an end of their own do.", None),
}
SERVER: Keys = {
    "address": Key(endpoint, "Where programs find the server."),
    "host": Key(host, "Where the server is with real connections; without it where `address` says.", None),
}
DOOR: Keys = {
    "address": Key(endpoint, "The address of a unit, and a port at which its program waits."),
    "bind": Key(host, "Address and port of this computer where others reach it; port 0: one that the system chooses.", None),
    "count": Key(whole(1, MOST), "So many doors: further ones lead to the addresses that follow.", 1),
    "counts": Key(one_of(("address", "port")), "What counts up with `count` in `bind`: the address, or the port.", "address"),
    "backlog": Key(flag, "Whether callers wait until a socket of the unit is free, where the unit refuses them.", False),
    "host": Key(host, "The former name of `bind`.", None),
}
UNIT: Keys = {
    "type": Key(one_of(tuple(UNIT_KINDS)), "What kind of unit it is.", "ETN21"),
    "address": Key(ip, "The unit's IP address; those of further equal PLCs count up from it."),
    "number": Key(whole(0, 15), "ETN21: the unit number.", None),
    "timing": Key(one_of(("exact", "real")), "ETN21: services end after fixed or after seeded numbers of scans.", None),
    "seed": Key(whole(0, MOST_NUMBER), "ETN21: where the random numbers of real timing begin.", None),
    "fins": Key(flag, "ETN21: whether it serves FINS, by UDP and TCP.", None),
    "fins_port": Key(whole(1, 65535), "ETN21: the port of FINS, 9600 if none is given.", None),
    "fins_node": Key(whole(0, 254), "ETN21: the FINS node, else the last part of the address; 0 is every node.", None),
    "fins_nodes": Key(texts_by_name, "ETN21: endpoints of FINS nodes that are not at their own address, such as "
                                     "{ 7 = \"192.168.251.2:9600\" }.", None),
    "fins_clients": Key(texts_by_name, "ETN21: FINS/TCP connections, 1 to 16, that the unit opens itself, each with its server, "
                                       "such as { 1 = \"192.168.250.2\" }; all others wait for clients.", None),
    "fins_permitted": Key(one_or_more(ip), "ETN21: addresses of clients whose FINS/TCP connections are accepted, else all are.",
                          None),
    "fins_access": Key(one_of(tuple(ACCESS)), "ETN21: what may be done by FINS: everything, no change of the mode, reads only.",
                       None),
    "fins_error_flags": Key(flag, "ETN21: whether end codes of FINS say, as those of the device, that the PLC has an error (40 "
                                  "or 80 hexadecimal): many clients take that for an error of the command.", None),
    "slot": Key(whole(0, 254), "NOC: the slot in the rack, 0 to 16, or 254 for the port of the CPU.", None),
    "mac": Key(text, "NOC: the MAC address that the program reads.", None),
    "module": Key(whole(0, 31), "NOC: the number of the module type that the program reads.", None),
    "http": Key(flag, "NOC: whether the HTTP service is configured.", None),
    "ftp": Key(flag, "NOC: whether the FTP service is configured.", None),
    "restart": Key(time_ns, "NOC: how long a restart takes.", None),
    "port": Key(whole(1, 65535), "OpenPLC: the port at which it waits for Modbus clients, 502 if none is given.", None),
    "clients": Key(whole(1, 64), "OpenPLC: how many clients it has at once, 8 if nothing is said.", None),
    "read_only": Key(flag, "OpenPLC: whether everything that writes is refused.", None),
    "model": Key(text, "Tianxing: \"T3\" with 8 connections or \"T4\" with 32.", None),
}
"""The keys of all units; which of them a unit has depends on its type."""
SET: Keys = {
    "name": Key(text, "A variable, an address or a range."),
    "value": Key(anything, "Its new value: a number, true or false, a text such as \"T#5s\", or a list for a range."),
    "at": Key(moment_ns, "When after power-on.", 0),
}
PLC: Keys = {
    "sources": Key(texts, "Its source files, from the folder of the project file."),
    "program": Key(text, "The PROGRAM to run, where sources have several and no CONFIGURATION.", None),
    "resource": Key(text, "The RESOURCE to run, where a CONFIGURATION has several.", None),
    "dialect": Key(one_of(tuple(DIALECTS)), "How to answer what compilers disagree about; without it \"twincat\" if a source is "
                                             "TwinCAT's, else \"standard\".", None),
    "libraries": Key(texts, "Folders of blocks that are asked before the shipped ones.", ()),
    "heap": Key(whole(0, LARGEST_HEAP), "Bytes that __NEW can take at the same time, 1 MiB if nothing is said.", None),
    "cycle": Key(time_ns, "The cycle time.", 10_000_000),
    "watch_cycle": Key(time_between(SHORTEST_NS, LONGEST_NS, "from 10ms to 40s"),
                       "The longest time that a scan may take, where time is real.", USUAL_NS),
    "pace": Key(one_of(PACES), "When to scan: once a period, or as soon as something happens (real connections only).",
                PACES[0]),
    "engine": Key(one_of(CHOICES), "What executes the program: Python first and machine code when it pays, or one alone.",
                  "auto"),
    "count": Key(whole(1, MOST), "So many equal PLCs, named pump[1], pump[2] and so on.", None),
    "until": Key(text, "The condition that ends its run, such as \"Main.Done AND D200 > 5\".", None),
    "watch": Key(texts, "What is printed of it at the end: variables, addresses, ranges.", ()),
    "unit": Key(UNIT, "A unit on its backplane.", (), many=True),
    "set": Key(SET, "A value to be written once.", (), many=True),
}
PROJECT: Keys = {
    "run": Key(RUN, "The run as a whole.", None),
    "server": Key(SERVER, "A Modbus TCP server that programs talk to.", (), many=True),
    "door": Key(DOOR, "Where others reach a unit with real connections.", (), many=True),
    "fault": Key(FAULT, "What goes wrong on the network; of several rows that fit the first counts.", (), many=True),
    "picture": Key(PICTURE, "A drawing of the machine on the page of `fbvm live`.", (), many=True),
    "plc": Key(PLC, "A PLC, or several equal ones, by name.", named=True),
}


@dataclass(frozen=True)
class UnitRow:
    """A unit of the first PLC of its kind; the others have addresses that follow."""

    kind: str
    address: str
    options: Mapping[str, Any]
    """What else is written, by its keys."""


@dataclass(frozen=True)
class SetRow:
    """A value that is written once."""

    name: str
    value: object
    at_ns: int


@dataclass(frozen=True)
class PlcRow:
    """PLCs of one kind: `count` None is a single one, whose name has no number."""

    name: str
    sources: tuple[Path, ...]
    program: str | None
    resource: str | None
    dialect: str
    libraries: tuple[Path, ...]
    cycle_ns: int
    watch_cycle_ns: int
    pace: str
    engine: str
    count: int | None
    until: str | None
    watch: tuple[str, ...]
    units: tuple[UnitRow, ...]
    sets: tuple[SetRow, ...]
    first: int = 1
    """With `count`: the number of the first one; others of the project may run elsewhere."""
    heap: int | None = None
    """Bytes of the heap; None for as many as usual."""


@dataclass(frozen=True)
class Project:
    """What a project file says."""

    source: Source
    """The project file, for messages."""
    net: str
    """"loop" for a network in memory, "tcp" for real connections."""
    seed: int
    """What decides random delays and faults of a network in memory."""
    for_ns: int | None
    """How long a run takes in nanoseconds; None for no bound."""
    scans: int | None
    """How many scans each PLC executes; None for no bound."""
    servers: tuple[tuple[Peer, tuple[str, int] | None], ...]
    """Endpoint of a Modbus server and where it is on the host; None: where its endpoint says."""
    doors: tuple[tuple[Peer, tuple[str, int]], ...]
    """A unit's endpoint and where others reach it on the host."""
    backlog: frozenset[Peer]
    """The units' endpoints whose doors hold callers until a socket is free."""
    faults: tuple[Fault, ...]
    """What goes wrong on a network in memory."""
    plcs: tuple[PlcRow, ...]
    """The PLCs, in the order of the file."""
    pictures: tuple[Picture, ...] = ()
    """Drawings of the machine."""

    def wrong_on(self, net: str) -> list[Diagnostic]:
        """What the file says and cannot be done on this network, "loop" or "tcp"."""
        reading = Reading(self.source)
        if net == "tcp":
            for number, message in impossible_on_the_host(self.faults, (endpoint for endpoint, _ in self.doors)):
                reading.report("P0103", ("fault", number), message)
        return reading.diagnostics


def project_file(path: Path) -> Path | None:
    """The project file for a path: itself if it is a .toml file, `fbvm.toml` in a folder; None for any other."""
    if path.is_dir():
        path = path / FILE
    return path if path.suffix == ".toml" and path.is_file() else None


def read_project(path: Path, *, allow_outside: bool = False, text: str | None = None) -> Project | list[Diagnostic]:
    """Reads a project file.  Returns the project, or all diagnostics of the file; sources are not read yet.

    Sources and libraries have to be in the folder of the file or below, unless `allow_outside`.  `text` is what stands in the
    file once it is saved; the file itself is not read then."""
    found = read(path, str(path), most_bytes=SETTINGS_BYTES) if text is None else Source(str(path), text)
    if isinstance(found, Diagnostic):
        return [found]
    reading = Reading(found)
    written = reading.load()
    if reading.diagnostics:
        return reading.diagnostics
    table = reading.table(written, PROJECT)
    if table["plc"] == {} and not errors(reading.diagnostics):
        reading.report("P0104", ("plc",), "there is no PLC", "begin one with [plc.NAME] and its sources")
    if not errors(reading.diagnostics):
        _check_units(reading, table["plc"])
        _check_paths(reading, table["plc"], path.parent)
        _check_endpoints(reading, table)
        check_faults(reading, table["fault"])
        check_pictures(reading, table, path.parent, allow_outside=allow_outside)
        if not allow_outside:
            _check_inside(reading, table["plc"], path.parent)
    if errors(reading.diagnostics):
        return sorted(reading.diagnostics, key=Diagnostic.order)
    run = table["run"] or {name: key.default for name, key in RUN.items()}
    made = Project(
        found, run["net"], run["seed"], run["for"], run["scans"],
        tuple((row["address"], row["host"]) for row in table["server"]),
        tuple(door for row in table["door"] for door in doors_of(row)),
        frozenset(unit for row in table["door"] if row["backlog"] for unit, _ in doors_of(row)),
        tuple(fault_of(row) for row in table["fault"]),
        tuple(_plc(name, row, path.parent) for name, row in table["plc"].items()),
        pictures_of(table["picture"], path.parent, table["plc"]),
    )  # fmt: skip
    return made.wrong_on(made.net) or made


def _check_endpoints(reading: Reading, table: Mapping[str, Any]) -> None:
    """Reports doors that say not, or twice, where they are, and endpoints with two rows."""
    for number, row in enumerate(table["door"]):
        if row["bind"] is None and row["host"] is None:
            reading.report("P0104", ("door", number), f"door {number + 1}.bind is missing", DOOR["bind"].meaning)
        if row["bind"] is not None and row["host"] is not None:
            reading.report("P0103", ("door", number, "host"), f"door {number + 1} has bind and host, which are the same")
        try:
            list(doors_of(row))
        except ValueError as error:
            reading.report("P0103", ("door", number, "count"), f"door {number + 1}: {error}")
            return
    for name in ("server", "door"):
        known: dict[Peer, int] = {}
        for number, row in enumerate(table[name]):
            addresses = [unit for unit, _ in doors_of(row)] if name == "door" else [row["address"]]
            first = min((known.setdefault(address, number) for address in addresses), default=number)
            if first != number:
                reading.report("P0103", (name, number), f"{name} {number + 1} has the address of {name} {first + 1}")


def doors_of(row: Mapping[str, Any]) -> Iterator[tuple[Peer, tuple[str, int]]]:
    """The units' endpoints of a row of doors, and where each is on the host.  Raises ValueError where these do not count up."""
    if (real := row["bind"] or row["host"]) is None:
        return
    for number in range(row["count"]):
        unit = replace(row["address"], host=_counted(row["address"].host, number))
        if row["counts"] == "address":
            yield unit, (_counted(real[0], number), real[1])
        elif not real[1] or real[1] + number <= LAST_PORT:
            yield unit, (real[0], real[1] + number if real[1] else 0)
        else:
            raise ValueError(f"there are no {row['count']:,} ports from {real[1]} on")


def _counted(host: str, number: int) -> str:
    """The address so many behind another one; of 0 the host as it is written.  Raises ValueError."""
    if not number:
        return host
    try:
        first = IPv4Address(host)
    except ValueError:
        first = IPv4Address(0)
    if first.is_unspecified:
        raise ValueError(f'{host} is no address that counts up; write counts = "port"')
    if int(first) + number > MOST_ADDRESS:
        raise ValueError(f"the addresses behind {host} are too few")
    return str(first + number)


def _check_inside(reading: Reading, plcs: Mapping[str, Any], folder: Path) -> None:
    """Reports sources and libraries that lie outside of the project's folder, also by a link."""
    root = resolved(folder)
    for name, row in plcs.items():
        for key in ("sources", "libraries"):
            for written in row[key]:
                found = resolved(folder / written)
                is_device = found.exists() and not found.is_file() and not found.is_dir()  # which the reader refuses
                if not found.is_relative_to(root) and not is_device:
                    reading.report("P0103", ("plc", name, key), f"plc.{name}.{key}: {written} is outside of the project",
                                   "paths stay inside the folder of the project file; --allow-outside takes others, too")


def _options(unit: Mapping[str, Any]) -> dict[str, Any]:
    """What is written of a unit beside its type and address."""
    return {key: value for key, value in unit.items() if key not in ("type", "address") and value is not None}


def _check_units(reading: Reading, plcs: Mapping[str, Any]) -> None:
    """Complain about keys that belong to units of another type."""
    for name, row in plcs.items():
        for number, unit in enumerate(row["unit"]):
            kind = unit["type"]
            for key in _options(unit).keys() - UNIT_KINDS[kind][1].keys():
                path = ("plc", name, "unit", number, key)
                known = ", ".join(UNIT_KINDS[kind][1])
                reading.report("P0102", path, f"{key} is no key of a unit of type {kind}", f"it has address, {known}")


def _check_paths(reading: Reading, plcs: Mapping[str, Any], folder: Path) -> None:
    """Complain about paths that only another system takes, such as those with backslashes."""
    for name, row in plcs.items():
        for key in ("sources", "libraries"):
            for written in row[key]:
                hint = foreign_path(written)
                if hint and not (folder / written).is_dir() and not (folder / written).is_file():
                    reading.report("P0103", ("plc", name, key), f"plc.{name}.{key}: {written} is no path on this system", hint)


def near(path: Path) -> str:
    """A hint for a file that is not there: one of a similar name, or the sources that its folder has."""
    there = sorted(found.name for found in path.parent.glob("*.st")) if path.parent.is_dir() else []
    if near := get_close_matches(path.name, there, 1):
        return f"did you mean {near[0]}?"
    return f"there is {', '.join(there[:MOST_NAMED])}" + ", ..." * (len(there) > MOST_NAMED) if there else ""


def _plc(name: str, row: Mapping[str, Any], folder: Path) -> PlcRow:
    sources = tuple(folder / source for source in row["sources"])
    return PlcRow(
        name, sources, row["program"], row["resource"], row["dialect"] or usual_dialect(sources),
        tuple(folder / library for library in row["libraries"]), row["cycle"],
        row["watch_cycle"], row["pace"], row["engine"], row["count"],
        row["until"], row["watch"],
        tuple(UnitRow(unit["type"], unit["address"], _options(unit)) for unit in row["unit"]),
        tuple(SetRow(one["name"], one["value"], one["at"]) for one in row["set"]), heap=row["heap"],
    )  # fmt: skip
