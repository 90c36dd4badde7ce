"""The Ethernet port of a Baosight Tianxing controller, as its communication blocks meet it: a table.

How many connections a controller has is from its manual, 7.15.4; the words are this project's own."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass

from fbvm.units.port.unit import MailboxUnit, Table

MODELS = {"T3": 8, "T4": 32}
"""TCP connections of each controller."""


@dataclass(eq=False)
class Tianxing(MailboxUnit):
    """The port of a controller of a model ("T3" or "T4").  Raises ValueError for another."""

    address: str = "192.168.250.23"
    _: KW_ONLY
    model: str = "T4"

    table = Table(
        name="Tianxing {unit.model}",
        area="TXP",
        block="MB_TCP_SERVER",
        lines="MB_TCP_Lines",
        shows={
            "MB_TCP_Ready": lambda port: 1,
            "MB_TCP_Connections": lambda port: MODELS[port.model],
            "MB_TCP_Own_IP": lambda port: port.own_ip,
        },
        settings={"model": lambda port: port.model, "connections": lambda port: str(MODELS[port.model])},
        lamps={"READY": ("MB_TCP_Ready", 1)},
        refusals=[
            (lambda port: port.model not in MODELS, f"there is no model {{unit.model}}; there are {' and '.join(MODELS)}"),
        ],
    )
