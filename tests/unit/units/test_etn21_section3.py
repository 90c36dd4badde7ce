"""Every request switch in every situation of its parameter area and its socket: which code it gets, as one table."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from etn21_rig import SERVER, Rig

from fbvm.units.etn21.map import Switch
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.link import Closed, Event, Failed, Opened, Peer

Prepare = Callable[[Rig], None]


def settle(rig: Rig, *events: Event) -> None:
    """Some time after these events: what can end has ended."""
    rig.scan()
    rig.scan(*events)
    for _ in range(20):
        rig.scan()


def service(switch: Switch, area: int, socket: int = 1, *answers: Event) -> Prepare:
    """Requests a service of a socket by an area; it runs as long as the network does not answer."""

    def prepare(rig: Rig) -> None:
        rig.parameters(area, socket, local_port=3000 + socket, count=2)
        rig.scan(switch, area=area)
        settle(rig, *answers)

    return prepare


def tcp(area: int, socket: int = 1) -> Prepare:
    return service(Switch.ACTIVE_OPEN, area, socket, Opened(socket, 3001, SERVER))


def udp(area: int, socket: int = 1) -> Prepare:
    return service(Switch.UDP_OPEN, area, socket, Opened(socket, 3001, Peer("0.0.0.0", 0)))


SITUATIONS: dict[str, tuple[Prepare, ...]] = {
    "nothing": (),
    "opening here": (service(Switch.ACTIVE_OPEN, 1),),
    "opening elsewhere": (service(Switch.ACTIVE_OPEN, 2),),
    "listening here": (service(Switch.PASSIVE_OPEN, 1),),
    "listening elsewhere": (service(Switch.PASSIVE_OPEN, 2),),
    "TCP here": (tcp(1),),
    "TCP elsewhere": (tcp(2),),
    "UDP here": (udp(1),),
    "UDP elsewhere": (udp(2),),
    "area has socket 2": (tcp(1, 2),),
    "and socket 1 is open": (tcp(1, 2), tcp(3, 1)),
    "and socket 1 is UDP": (tcp(1, 2), udp(3, 1)),
    "area has socket 2, UDP": (udp(1, 2),),
    "area opens socket 2": (service(Switch.ACTIVE_OPEN, 1, 2),),
    "receiving here": (tcp(1), service(Switch.RECEIVE, 1)),
    "receiving elsewhere": (tcp(2), service(Switch.RECEIVE, 2)),
    "sending here": (tcp(1), service(Switch.SEND, 1)),
    "sending elsewhere": (tcp(2), service(Switch.SEND, 2)),
    "both elsewhere": (tcp(2), service(Switch.SEND, 2), service(Switch.RECEIVE, 3)),
    "UDP receiving here": (udp(1), service(Switch.RECEIVE, 1)),
    "UDP receiving elsewhere": (udp(2), service(Switch.RECEIVE, 2)),
    "closing here": (tcp(1), service(Switch.CLOSE, 1)),
    "closing elsewhere": (tcp(2), service(Switch.CLOSE, 2)),
    "closed": (tcp(1), service(Switch.CLOSE, 1, 1, Closed(1))),
    "closed elsewhere": (tcp(2), service(Switch.CLOSE, 2, 1, Closed(1))),
    "closed by another area": (tcp(1), service(Switch.CLOSE, 2, 1, Closed(1))),
    "failed to open": (service(Switch.ACTIVE_OPEN, 1, 1, Failed(1, "open", "ECONNREFUSED")),),
}

TABLE = """
                          UDP   PAS   ACT   SEND  RECV  CLOSE
nothing                   ok    ok    ok    2210  2210  2210
opening here              110C  110C  =     110C  110C  ok
opening elsewhere         2606  220F  220F  2210  2210  ok
listening here            110C  =     110C  110C  110C  ok
listening elsewhere       2606  220F  220F  2210  2210  ok
TCP here                  2607  220F  220F  ok    ok    ok
TCP elsewhere             2606  220F  220F  ok    ok    ok
UDP here                  220F  2607  2607  ok    ok    ok
UDP elsewhere             220F  2606  2606  ok    ok    ok
area has socket 2         2607  2607  2607  2607  2607  2607
and socket 1 is open      2607  2607  2607  2607  2607  2607
and socket 1 is UDP       2607  2607  2607  2607  2607  2607
area has socket 2, UDP    2607  2607  2607  2607  2607  2607
area opens socket 2       110C  110C  =     110C  110C  2210
receiving here            110C  110C  110C  110C  =     ok
receiving elsewhere       2606  220F  220F  ok    220F  ok
sending here              110C  110C  110C  =     110C  ok
sending elsewhere         2606  220F  220F  220F  ok    ok
both elsewhere            2606  220F  220F  220F  220F  ok
UDP receiving here        110C  110C  110C  110C  =     ok
UDP receiving elsewhere   220F  2606  2606  ok    220F  ok
closing here              110C  110C  110C  110C  110C  =
closing elsewhere         2606  220F  220F  2210  2210  2210
closed                    ok    ok    ok    2210  2210  2210
closed elsewhere          ok    ok    ok    2210  2210  2210
closed by another area    ok    ok    ok    2210  2210  2210
failed to open            ok    ok    ok    2210  2210  2210
"""


def outcome(situation: str, switch: Switch, timing: str, seed: int) -> str:
    """The code of a request by area 1 for socket 1; "ok" if it is being served, "=" if it is running already."""
    rig = Rig(Etn21(timing=timing, seed=seed))
    for prepare in SITUATIONS[situation]:
        prepare(rig)
    if rig.is_on(switch):
        return "="
    running = [other for other in Switch if rig.is_on(other)]
    rig.parameters(1, 1, local_port=4000, count=2)
    rig.scan(switch)
    for _ in range(20):
        rig.scan()
    if switch is not Switch.CLOSE:
        assert all(rig.is_on(other) for other in running), "what ran goes on"
    return "ok" if rig.is_on(switch) else rig.code()


@pytest.mark.slow
@pytest.mark.parametrize(("timing", "seed"), [("exact", 0), ("real", 1), ("real", 2)])
def test_every_switch_in_every_situation_assumed(timing: str, seed: int) -> None:
    """What the manual leaves open is assumed: services of other areas, the order of the checks."""
    lines = [f"{'':24}  {'UDP':6}{'PAS':6}{'ACT':6}{'SEND':6}{'RECV':6}CLOSE"]
    for situation in SITUATIONS:
        cells = [outcome(situation, switch, timing, seed) for switch in Switch]
        lines.append(f"{situation:24}  " + "".join(f"{cell:6}" for cell in cells).rstrip())
    assert "\n".join(lines) == TABLE.strip("\n")
