"""Rows of `[[fault]]` as faults and back: what a key sets, what a kind needs, what real connections cannot have."""

from __future__ import annotations

from typing import Any

import pytest
from rows import each_of

from fbvm.net.faults import FOREVER, KINDS, NAMED, Fault
from fbvm.run.fault_rows import FAULT, check_faults, fault_of, impossible_on_the_host, key_of, settings
from fbvm.wire.link import Peer

MS = 1_000_000
DOOR = Peer("10.0.0.1", 502)


def row(**written: Any) -> dict[str, Any]:
    """A row that has been read: what is not written has its default."""
    return {key: each.default for key, each in FAULT.items()} | {key.rstrip("_"): value for key, value in written.items()}


@each_of("written, fault", [
    ({}, Fault()), ({"kind": "silent"}, Fault(silent=True)), ({"kind": "silent", "silent": False}, Fault()),
    ({"kind": "cut", "segment_bytes": 9}, Fault(segment_bytes=9, random_cut=True)),
    ({"kind": "cut", "random_cut": False}, Fault(segment_bytes=5)),
    ({"latency": 0, "jitter": 5, "gap": 0, "join": 7}, Fault(latency_ns=0, jitter_ns=5, gap_ns=0, join_ns=7)),
    ({"from_": 3, "until": 9, "from_scan": 1, "until_scan": 2}, Fault(from_ns=3, until_ns=9, from_scan=1, until_scan=2)),
    ({"peer": DOOR, "error": "EHOSTUNREACH", "reset": True}, Fault(DOOR, error="EHOSTUNREACH", reset=True)),
    ({"lose_percent": 1, "duplicate_percent": 2, "reset_after_bytes": 3}, Fault(lose_percent=1, duplicate_percent=2,
                                                                               reset_after_bytes=3)),
])
def test_the_keys_of_a_row_set_the_fields_of_a_fault(written: dict[str, Any], fault: Fault) -> None:
    assert fault_of(row(**written)) == fault


def test_each_field_has_its_key() -> None:
    assert {key_of(field) for field in Fault.__dataclass_fields__} | {"kind"} == set(FAULT)


class Reading:
    """Keeps what is reported: the code, the place in the file, the message, the help."""

    def __init__(self) -> None:
        self.said: list[tuple[Any, ...]] = []

    def report(self, code: str, place: tuple[Any, ...], message: str, meaning: str = "") -> None:
        self.said.append((code, place, message, meaning))


SEGMENT = "Data arrive in pieces of so many bytes."


@each_of("rows, said", [
    ([row(kind="slow", latency=5)], []), ([row(kind="cut", gap=1)], []), ([row(segment_bytes=1, gap=1, random_cut=True)], []),
    ([row(from_=1, until=2, from_scan=1, until_scan=2)], []), ([row(gap=1), row(random_cut=False)], [
        ("P0103", ("fault", 0, "gap"), "fault 1.gap does nothing without segment_bytes", SEGMENT),
        ("P0103", ("fault", 1, "random_cut"), "fault 2.random_cut does nothing without segment_bytes", SEGMENT)]),
    ([row(), row(kind="slow")], [("P0104", ("fault", 1), "fault 2.latency is missing: kind slow",
                                  "How long data take for one way.")]),
    ([row(from_=2, until=2)], [("P0103", ("fault", 0), "fault 1 ends before it begins: until is not after from", "")]),
    ([row(from_=FOREVER)], [("P0103", ("fault", 0), "fault 1 ends before it begins: until is not after from", "")]),
    ([row(from_scan=2, until_scan=2)], [
        ("P0103", ("fault", 0), "fault 1 ends before it begins: until_scan is not after from_scan", "")]),
    ([row(from_scan=3, until_scan=2, from_=3, until=2)], [
        ("P0103", ("fault", 0), "fault 1 ends before it begins: until is not after from", ""),
        ("P0103", ("fault", 0), "fault 1 ends before it begins: until_scan is not after from_scan", "")]),
])
def test_what_a_row_says_in_vain_is_reported_at_its_place(rows: list[dict[str, Any]], said: list[tuple[Any, ...]]) -> None:
    reading: Any = Reading()
    check_faults(reading, rows)
    assert reading.said == said


@each_of("faults, wrong", [
    ([Fault(DOOR, error="EHOSTUNREACH")], [(0, "EHOSTUNREACH")]), ([Fault(DOOR, error="ECONNREFUSED")], []), ([Fault(DOOR)], []),
    ([Fault(DOOR, error="EHOSTUNREACH", silent=True)], []), ([Fault(error="EHOSTUNREACH")], []),
    ([Fault(Peer("10.0.0.1", 0), error="ETIMEDOUT")], [(0, "ETIMEDOUT")]),
    ([Fault(Peer("10.0.0.1", 503), error="ETIMEDOUT")], []), ([Fault(Peer("10.0.0.9", 502), error="ETIMEDOUT")], []),
    ([Fault(), Fault(DOOR, error="ETIMEDOUT"), Fault(DOOR, error="ENETDOWN")], [(1, "ETIMEDOUT"), (2, "ENETDOWN")]),
])
def test_callers_of_a_door_can_be_refused_or_ignored_only(faults: list[Fault], wrong: list[tuple[int, str]]) -> None:
    found = list(impossible_on_the_host(faults, iter([Peer("10.0.0.5", 502), DOOR])))
    given = ("fault {}: callers of the door 10.0.0.1:502 cannot be given {} with real connections, only ECONNREFUSED, "
             "or silent = true")
    assert found == [(number, given.format(number + 1, error)) for number, error in wrong]
    assert list(impossible_on_the_host(faults, [])) == []


@each_of("fault, without, written", [
    (Fault(), (), []), (Fault(silent=True, reset=True), (), [("silent", "true"), ("reset", "true")]),
    (Fault(latency_ns=1_500 * MS, gap_ns=0), (), [("latency", '"1s500ms"'), ("gap", '"0s"')]),
    (Fault(error="ETIMEDOUT", lose_percent=7), (), [("error", '"ETIMEDOUT"'), ("lose_percent", "7")]),
    (Fault(latency_ns=5, jitter_ns=MS), ("latency",), [("latency", "..."), ("jitter", '"1ms"')]),
])
def test_what_a_fault_sets_is_written_as_in_the_file(fault: Fault, without: tuple[str, ...],
                                                     written: list[tuple[str, str]]) -> None:  # fmt: skip
    assert list(settings(fault, without)) == written


@pytest.mark.parametrize("kind", sorted(NAMED))
def test_a_kind_is_its_settings(kind: str) -> None:
    assert fault_of(row(kind=kind)) == KINDS[kind] and list(settings(KINDS[kind]))


@each_of("value, good", [("ECONNREFUSED", True), ("EHOSTUNREACH", True), ("ENOSUCH", False), ("errorcode", False), (5, False)])
def test_an_error_is_one_that_the_host_knows(value: object, good: bool) -> None:
    check: Any = FAULT["error"].kind.value  # type: ignore[union-attr]
    if good:
        assert check(value) == value
    else:
        with pytest.raises(ValueError, match="is no errno name such as ECONNREFUSED or EHOSTUNREACH"):
            check(value)
