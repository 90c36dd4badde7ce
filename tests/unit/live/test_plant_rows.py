"""What the panel of a plant lists."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from rows import each_of

from fbvm.live.plcs import Traffic
from fbvm.live.updates import MOST_LINKS, plant_rows
from fbvm.net.faults import fault
from fbvm.wire.link import Peer


class Stub(SimpleNamespace):
    """A PLC of a plant, as far as the panel asks."""

    def state(self, stands: bool) -> str:
        return "pause" if stands else "run"


def plc(name: str, scans: int, trap: str = "", traffic: dict[str, Traffic] | None = None, units: tuple[str, ...] = ()) -> Any:
    attached = [SimpleNamespace(unit=SimpleNamespace(name=f"ETN21 {number}", address=address))
                for number, address in enumerate(units)]  # fmt: skip
    ended = SimpleNamespace(told=lambda instance: f"{trap} in {instance('it')}") if trap else None
    return Stub(name=name, plc=SimpleNamespace(mode=SimpleNamespace(value="RUN"), scans=scans, trap=ended, units=attached),
                names=SimpleNamespace(instance=lambda of: of), traffic=traffic or {})  # fmt: skip


def bench(*plcs: Any, stands: bool = False, **more: Any) -> Any:
    return SimpleNamespace(control=SimpleNamespace(stands=stands), plcs={live.name: live for live in plcs},
                           is_plugged=lambda attached: attached.unit.address != "10.0.0.2", **{
                               "networks": [], "faults": [], **more})  # fmt: skip


def test_the_plcs_of_a_plant_are_listed_with_their_units_and_traps() -> None:
    one, other = plc("pump", 42, units=("10.0.0.1", "10.0.0.2")), plc("tank", 0, trap="R0101")
    assert plant_rows(bench(one, other))["plcs"] == [
        {"name": "pump", "state": "run", "mode": "RUN", "scan": 41, "trap": "", "units": [
            {"name": "ETN21 0", "address": "10.0.0.1", "plugged": True},
            {"name": "ETN21 1", "address": "10.0.0.2", "plugged": False}]},
        {"name": "tank", "state": "run", "mode": "RUN", "scan": -1, "trap": "R0101 in it", "units": []}]
    assert [row["state"] for row in plant_rows(bench(one, other, stands=True))["plcs"]] == ["pause", "pause"]


def passed(frames: int, info: str) -> Traffic:
    made = Traffic("10.0.0.1", "10.0.0.2")
    made.frames, made.info = frames, info
    return made


@each_of(("counts", "wanted"), [((3, 5), (5, "b")), ((5, 3), (5, "a")), ((4, 4), (4, "a"))])
def test_of_a_link_between_two_plcs_the_one_counts_that_saw_more(counts: tuple[int, int], wanted: tuple[int, str]) -> None:
    lives = [plc(name, 1, traffic={"x": passed(count, name)}) for name, count in zip("ab", counts, strict=True)]
    assert plant_rows(bench(*lives))["links"] == [["10.0.0.1", "10.0.0.2", *wanted]]


def test_there_are_so_many_links_and_no_more_and_doors_and_faults_are_named() -> None:
    many = plc("a", 1, traffic={str(number): passed(1, str(number)) for number in range(MOST_LINKS + 1)})
    late = plc("b", 1, traffic={"0": passed(9, "later")})
    network = SimpleNamespace(doors={Peer("10.0.0.1", 502): Peer("127.0.0.1", 1502)})
    faults = [fault("slow", latency_ns=1, peer=Peer(host, 502)) for host in ("10.0.0.9", "10.0.0.3", "10.0.0.9")]
    rows = plant_rows(bench(many, late, networks=[network, object()], faults=faults))
    assert [link[3] for link in rows["links"]] == ["later", *(str(number) for number in range(1, MOST_LINKS))]
    assert rows["doors"] == [["10.0.0.1:502", "127.0.0.1:1502"]] and rows["faults"] == ["10.0.0.3", "10.0.0.9"]
