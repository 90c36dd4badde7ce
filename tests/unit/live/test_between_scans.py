"""What a page does between scans, how long a request may be, and when a page begins again."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from browsers import HOST, PORT, TOKEN, Page, connected, frame
from rows import each_of

from fbvm.base.types import WORD
from fbvm.live import host as host_module
from fbvm.live.connection import MOST_REQUEST_BYTES, Connection
from fbvm.live.guard import Guard
from fbvm.live.host import LOOK_TICKS, LiveHost
from fbvm.live.plcs import LivePlc
from fbvm.live.pytest_text import plant_text
from fbvm.live.updates import STEP, UPDATE_NS, Updates

pytestmark = pytest.mark.slow


@pytest.fixture
def served() -> Iterator[LiveHost]:
    host = LiveHost(Page().bench, token="t")
    yield host
    host.close()


def test_a_plc_is_told_before_and_behind_its_scan_and_forgets_a_statement_where_it_stands(
    served: LiveHost, monkeypatch: pytest.MonkeyPatch
) -> None:
    host = served
    told: list[str] = []
    monkeypatch.setattr(host_module, "forget_statement", lambda live: told.append(f"forget {live.name}"))
    for halted in (None, object()):
        plc = SimpleNamespace(halted=halted)
        live = SimpleNamespace(name="x", plc=plc, before_scan=lambda: told.append("before"),
                               after_scan=lambda: told.append("after"))  # fmt: skip
        host._plcs = [live]  # type: ignore[list-item]
        host.before_scan(0, 5)
        host.after_scan(0, 5)
    assert told == ["before", "after", "before", "after", "forget x"]


def test_files_are_looked_at_every_third_tick_and_ticks_are_100_ms_apart(
    served: LiveHost, monkeypatch: pytest.MonkeyPatch
) -> None:
    host = served
    told: list[str] = []
    look: Any = SimpleNamespace(look=lambda: told.append("look"))
    host.workbench = SimpleNamespace(changes=look, pictures=None, groups=look, held_by="",  # type: ignore[assignment]
                                     let_go=lambda: None)
    monkeypatch.setattr(host, "_tick", lambda: told.append("tick"))
    monkeypatch.setattr(host.server, "update", lambda now_ns, is_late: None)
    for now_ns in (UPDATE_NS - 1, UPDATE_NS, UPDATE_NS + 1, 2 * UPDATE_NS - 1, 2 * UPDATE_NS, 3 * UPDATE_NS, 4 * UPDATE_NS):
        host.update(now_ns, lambda: False)
    assert told == ["tick"] * LOOK_TICKS + ["look", "look", "tick"]


def test_a_page_is_told_once_that_other_plcs_run() -> None:
    page = Page()
    page.done("hello", version=1)
    page.done("look", plc="pump", names=["Main.Level"])
    page.session.begin_again()
    first = page.session.update(UPDATE_NS)
    assert first is not None and json.loads(first) == {"update": {"restarted": True}}
    page.done("ready")
    second = page.session.update(2 * UPDATE_NS)
    assert second is not None and json.loads(second)["update"]["values"] == {"Main.Level": "20"}


def test_a_request_that_does_not_end_is_left_when_it_is_too_long() -> None:
    made = Connection(Guard(PORT, token=TOKEN))
    line = b"X-Word: " + b"x" * 990 + b"\r\n"
    assert made.receive(b"GET / HTTP/1.1\r\n") == [] and not made.ends
    told = 16
    while told + len(line) <= MOST_REQUEST_BYTES:
        made.receive(line)
        told += len(line)
        assert not made.ends, told
    made.receive(line)
    assert made.ends and not made.has_output


def test_a_request_may_be_as_long_as_is_said_and_no_longer() -> None:
    for more in (0, 1):
        made = Connection(Guard(PORT, token=TOKEN))
        made.receive(b"GET / HTTP/1.1\r\n")
        lines, rest = divmod(MOST_REQUEST_BYTES - 16 + more, 1000)
        for size in [1000] * lines + [rest]:
            made.receive(b"X: " + b"x" * (size - 5) + b"\r\n")
        assert made.ends is bool(more)


@each_of(("wants", "armed", "halted", "real", "held", "views"), [
    (True, True, False, False, True, True), (False, True, False, False, True, False), (True, False, False, False, True, False),
    (True, True, True, False, True, False), (True, True, False, True, True, False), (True, True, False, False, False, False),
    (False, False, False, False, True, False),
])  # fmt: skip
def test_a_scan_with_breakpoints_is_executed_again_for_who_wants_to_see_it(
    wants: bool, armed: bool, halted: bool, real: bool, held: bool, views: bool
) -> None:
    plc = SimpleNamespace(halted=halted, breakpoints=SimpleNamespace(armed=armed), scans=5)
    closed: list[int] = []
    live: Any = SimpleNamespace(plc=plc, _observing=SimpleNamespace(close=lambda: closed.append(1)), is_real=real,
                                wants_view=wants, view=None, past_view=lambda scan: scan,
                                recorded=SimpleNamespace(scans=range(5 if held else 4)))
    LivePlc.after_scan(live)
    assert (live.view, live.wants_view, closed) == (4 if views else None, wants and not views, [1])


def test_messages_of_an_open_page_do_not_count_as_a_request() -> None:
    made, text = connected(), "x" * 6000
    for _ in range(MOST_REQUEST_BYTES // 6000 + 2):
        assert made.receive(frame(text.encode())) == [text] and not made.ends


@each_of(("host", "is_own"), [
    (HOST, True), ("localhost:8123", True), ("LOCALHOST:8123", True), ("127.0.0.1", False), ("127.0.0.1:", False),
    ("127.0.0.1:8124", False), ("127.0.0.1:08123", False), ("127.0.0.1:\N{FULLWIDTH DIGIT EIGHT}123", False),
    ("evil.example:8123", False),
    ("192.168.1.5:8123", False), (":8123", False),
])  # fmt: skip
def test_which_address_is_the_server_s_own(host: str, is_own: bool) -> None:
    refused = Guard(PORT, token=TOKEN).refusal("/", [host], [])
    assert (refused is None) is is_own


def test_a_test_of_all_plcs_names_the_network_only_where_something_was_done_to_it() -> None:
    fault = "from fbvm.net.faults import Fault"
    for acts, wanted, imports in (
            ([("write", {"plc": "pump", "name": "Main.Level", "value": "5"})], False, []),
            ([("fault", {"kind": "silent"})], True, [fault]),
            ([("cable", {"plc": "pump", "unit": "ETN21 0", "plugged": False})], True, ["from fbvm import Peer", fault])):
        page = Page()
        page.done("hello", version=1)
        page.scan(2)
        for do, fields in acts:
            page.done(do, **fields)
        page.scan()
        text = plant_text(page.bench.acts, page.live, [], Path("fbvm.toml"), {"pump": page.live})
        assert ("    network = made.network\n" in text) is wanted, text
        assert [line for line in text.splitlines() if "import " in line] == imports
        assert text.splitlines()[-3:] == ["    while plc.scans < 3:", "        made.scan()",
                                          "    assert all(rig.plc.trap is None for rig in made.rigs.values())"]  # fmt: skip


def test_values_of_many_pictures_are_read_in_steps_of_the_plcs_that_are_looked_at() -> None:
    here, other = object(), object()
    places = {f"k{number}": (here if number % 5 else other, SimpleNamespace(type=WORD, hexadecimal=number == 7, name=number))
              for number in range(3 * STEP + 1)}  # fmt: skip
    look = SimpleNamespace(instance=None, units=False, pictures=True)
    updates: Any = SimpleNamespace(_look=look, _bench=SimpleNamespace(pictures=SimpleNamespace(shown=["a"], places=places)),
                                   _copies={here: None}, _value=lambda live, place: place.name)
    made: dict[str, Any] = {}
    assert len(list(Updates._panels(updates, made, None))) == 3
    wanted = {f"k{number}": "16#0007" if number == 7 else str(number) for number in range(3 * STEP + 1) if number % 5}
    assert made == {"pictures": ["a"], "picture": wanted}
    look.pictures = False
    nothing: dict[str, Any] = {}
    assert list(Updates._panels(updates, nothing, None)) == [] and nothing == {}
