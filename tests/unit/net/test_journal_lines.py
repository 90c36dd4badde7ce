"""The lines of a journal as entries, whoever has written them; lines that are missing, or are of another form."""

from __future__ import annotations

import json
from typing import Any

import pytest
from rows import each_of

from fbvm.net.journal import FORMAT, Act, End, Header, JournalError, Scan, from_event, open_journal, to_event
from fbvm.wire.link import (
    Broken,
    Closed,
    Event,
    Failed,
    Opened,
    Peer,
    PeerClosed,
    Received,
    Sent,
)

HEAD: dict[str, Any] = {"journal": FORMAT, "image": "ab12", "cycle_ns": 10, "budget": 5, "about": {"a": 1}}
SCAN: dict[str, Any] = {"scan": 0, "now_ns": 7, "memory": "0f"}
EVENTS: list[Event] = [
    Opened(3, 49_152, Peer("10.0.0.1", 502)), Received(3, b"\x00\xff", Peer("10.0.0.1", 502)), Received(4, b""), Sent(3, 2),
    PeerClosed(3), Closed(3), Broken(3, "ECONNRESET"), Failed(3, "open", "ECONNREFUSED")]  # fmt: skip


def read(*lines: dict[str, Any] | str) -> tuple[Header, list[Any]]:
    texts = [line if isinstance(line, str) else json.dumps(line) + "\n" for line in lines]
    header, entries = open_journal(texts)
    return header, list(entries)


def test_each_kind_of_line_is_an_entry() -> None:
    header, entries = read(HEAD, {"mode": "RUN", "write": [[4, "0a0b"]]}, {"start": "warm"}, {"unit": ["Etn21", {}]}, {
        **SCAN, "write": [[1, "ff"]], "force": {"Main.a": True}, "unforce": ["Main.b"], "settings": {"0": {"link_up": False}},
        "events": {"1": [from_event(event) for event in EVENTS]}, "budget": 9, "watch": [12, 1_000]},
        {**SCAN, "scan": 1}, {"end": 2})
    assert header == Header("ab12", 10, 5, {"a": 1})
    assert entries == [
        Act("mode", "RUN", ((4, b"\x0a\x0b"),)), Act("start", "warm"), Act("unit", ["Etn21", {}]),
        Scan(0, 7, "0f", ((1, b"\xff"),), {"Main.a": True}, ("Main.b",), {0: {"link_up": False}}, {1: tuple(EVENTS)},
             9, (12, 1000)),
        Scan(1, 7, "0f"), End(2)]  # fmt: skip


@pytest.mark.parametrize("event", EVENTS, ids=lambda event: type(event).__name__)
def test_an_event_is_the_same_behind_its_plain_form(event: Event) -> None:
    plain = json.loads(json.dumps(from_event(event)))
    assert to_event(plain) == event and plain[0] == type(event).__name__


def test_what_a_killed_run_has_left_of_a_line_is_left_out_and_nothing_is_read_behind_the_end() -> None:
    assert read(HEAD, SCAN, '{"scan": 1, "no')[1] == [Scan(0, 7, "0f")]
    assert read(HEAD, SCAN, json.dumps({**SCAN, "scan": 1}))[1] == [Scan(0, 7, "0f")], "its line has no end"
    assert read(HEAD, {"end": 0}, "?\n")[1] == [End(0)]


@each_of(("lines", "said"), [
    ([], "the file is empty"), ([SCAN], "line 1: no journal of fbvm"), ([HEAD, HEAD], "line 2: a second header"),
    ([{**HEAD, "journal": FORMAT + 1}], f"this version of fbvm reads format {FORMAT}"), ([HEAD, {"x": 1}], "line 2: no entry"),
    ([HEAD, {**SCAN, "scan": 1}], "line 2: scan 1 where 0 should be"),
    ([HEAD, SCAN, {"end": 2}], "line 3: scan 2 where 1 should be"),
    ([HEAD, SCAN, SCAN], "line 3: scan 0 where 1 should be"), ([HEAD, {"scan": 0}], "line 2: 'now_ns' is missing"),
    ([HEAD, "[]\n"], "line 2: no entry of a journal"), ([HEAD, "{]\n"], "line 2: .* at column 2"),
    ([HEAD, {**SCAN, "watch": [1]}], "line 2: "), ([HEAD, {**SCAN, "write": [[1, "f"]]}], "line 2: "),
])  # fmt: skip
def test_a_journal_that_is_damaged_says_where(lines: list[Any], said: str) -> None:
    with pytest.raises(JournalError, match=said):
        read(*lines)
