"""A PLC with an Ethernet port and MB_TCP_SERVER in its program, and clients at the other end, all in virtual time.

    rig = Rig()
    client = rig.client().connect()
    assert client.ask("03 0000 0001") == "03 02 00 00"
"""

from __future__ import annotations

from functools import cache

from stream_client import Client

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.record.draw.chart import chart
from fbvm.units.port.tianxing import Tianxing
from fbvm.wire.link import Peer

CYCLE_NS = 10_000_000
ADDRESS = "192.168.250.23"
AREAS = {
    "coils": "ARRAY[0..99] OF BOOL", "inputs": "ARRAY[0..9] OF BYTE", "holding": "ARRAY[0..199] OF WORD",
    "registers": "ARRAY[0..199] OF WORD",
}  # fmt: skip
PINS = ("DISCONNECT := stop, CONNECT := config, COIL_DATAAREA := {coils}, DISCRETE_DATAAREA := {inputs}, "
        "HOLDING_REG_DATAAREA := {holding}, INPUT_REG_DATAAREA := {registers}")  # fmt: skip
OUTPUTS = ("Main.s.STATUS", "Main.s.NDR", "Main.s.DR", "Main.s.ERROR")


@cache
def image_of(text: str) -> Image:
    """The image of a program that has no errors; some declare what they do not use."""
    made = compile_text(text)
    assert made.image is not None, [message.message for message in made.diagnostics]
    return made.image


def program(areas: dict[str, str], passed: dict[str, str]) -> str:
    """The text of a program with one server `s`; `areas` declares its variables, `passed` says what goes to its pins."""
    variables = "".join(f"{name} : {kind}; " for name, kind in areas.items())
    pins = PINS.format(**{name: passed.get(name, name) for name in AREAS})
    own = "s : MB_TCP_SERVER; stop : BOOL; config : TCP_CONNECTCONFIG;"
    return f"PROGRAM Main\nVAR {own} {variables} END_VAR\ns({pins});\nEND_PROGRAM"


class Rig:
    """One PLC whose port is at 192.168.250.23."""

    def __init__(
        self, *, passed: dict[str, str] | None = None, text: str = "", model: str = "T4",
        network: LoopNetwork | None = None, **areas: str,
    ) -> None:  # fmt: skip
        self.network = network or LoopNetwork()
        self.plc = Plc(image_of(text or program({**AREAS, **areas}, passed or {})), CYCLE_NS)
        self.plc.attach(Tianxing(ADDRESS, model=model), self.network)

    def scan(self, count: int = 1) -> None:
        for _ in range(count):
            trap = self.plc.scan()
            assert trap is None, trap

    def set(self, name: str, value: object) -> None:
        self.plc.write(f"Main.{name}", value)

    def get(self, name: str) -> object:
        return self.plc.read(f"Main.{name}")

    def status(self, name: str = "s") -> str:
        """STATUS in hexadecimal, and the letters of NDR, DR and ERROR where they are TRUE."""
        status = self.get(f"{name}.STATUS")
        assert isinstance(status, int)
        pins = [pin for pin in ("NDR", "DR", "ERROR") if self.get(f"{name}.{pin}")]
        return " ".join([f"{status:04X}", *pins])

    def client(self, number: int = 50, port: int = 502) -> Client:
        link = self.network.attach(f"192.168.250.{number}")
        return Client(self.scan, self.plc, link, Peer(ADDRESS, port))

    def statuses(self, client: Client, scans: int) -> list[str]:
        """The status after each of some scans."""
        found = []
        for _ in range(scans):
            client.step()
            found.append(self.status())
        return found

    def chart(self, scans: int) -> str:
        return chart(self.plc, scans, [*OUTPUTS])
