"""Kinds of values that options take, each read once and refused with a sentence."""

from __future__ import annotations

from dataclasses import dataclass

import click

from fbvm.watch.values import parse_time_ns
from fbvm.wire.link import Peer


class Time(click.ParamType):
    """`10ms`, `1.5s`, `T#10ms`: nanoseconds."""

    name = "TIME"

    def convert(self, value: str | int, param: click.Parameter | None, ctx: click.Context | None) -> int:
        if isinstance(value, int):
            return value
        try:
            time_ns = parse_time_ns(value)
        except ValueError as error:
            self.fail(str(error), param, ctx)
        if time_ns <= 0:
            self.fail(f"{value} is not a time that can pass", param, ctx)
        return time_ns


@dataclass(frozen=True)
class Setting:
    """NAME=VALUE@TIME as written; the value is read when the name's type is known."""

    name: str
    value: str
    at_ns: int


class Set(click.ParamType):
    """`NAME=VALUE` or `NAME=VALUE@TIME`."""

    name = "NAME=VALUE[@TIME]"

    def convert(self, value: str | Setting, param: click.Parameter | None, ctx: click.Context | None) -> Setting:
        if isinstance(value, Setting):
            return value
        name, sign, text = value.partition("=")
        if not sign or not name.strip() or not text.strip():
            self.fail(f"{value!r} is not NAME=VALUE", param, ctx)
        at_ns = 0
        front, at, time = text.rpartition("@")
        if at and not text.rstrip().endswith(("'", '"')):
            try:
                at_ns = parse_time_ns(time)
            except ValueError as error:
                self.fail(str(error), param, ctx)
            text = front
        return Setting(name.strip(), text.strip(), at_ns)


@dataclass(frozen=True)
class Mapping:
    """IP:PORT=HOST:PORT, or IP:PORT=peer (`host` None)."""

    said: Peer
    host: str | None
    port: int


class Map(click.ParamType):
    """`IP:PORT=HOST:PORT` for real connections, `IP:PORT=peer` for a Modbus server in memory."""

    name = "IP:PORT=HOST:PORT|peer"

    def convert(self, value: str | Mapping, param: click.Parameter | None, ctx: click.Context | None) -> Mapping:
        if isinstance(value, Mapping):
            return value
        said, sign, real = value.partition("=")
        if not sign:
            self.fail(f"{value!r} is not IP:PORT=HOST:PORT or IP:PORT=peer", param, ctx)
        ip, port = self._endpoint(said, param, ctx)
        parts = ip.split(".")
        if len(parts) != 4 or not all(part.isdigit() and int(part) <= 255 for part in parts):
            self.fail(f"{ip!r} is no IPv4 address; a program knows no names", param, ctx)
        if real.strip() == "peer":
            return Mapping(Peer(ip, port), None, 0)
        host, host_port = self._endpoint(real, param, ctx)
        return Mapping(Peer(ip, port), host, host_port)

    def _endpoint(self, text: str, param: click.Parameter | None, ctx: click.Context | None) -> tuple[str, int]:
        host, colon, port = text.strip().rpartition(":")
        if not colon or not host or not port.isdigit() or not 0 <= int(port) <= 65535:
            self.fail(f"{text!r} is not an address and a port such as 192.168.250.1:502", param, ctx)
        return host, int(port)


TIME, SET, MAP = Time(), Set(), Map()


def split_names(text: str) -> list[str]:
    """The names of a list such as `Main.done,a[1,2],D5`: commas within brackets do not part."""
    names, depth = [""], 0
    for character in text:
        depth += {"[": 1, "]": -1}.get(character, 0)
        if character == "," and depth == 0:
            names.append("")
        else:
            names[-1] += character
    return [name.strip() for name in names if name.strip()]
