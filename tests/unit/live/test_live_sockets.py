"""The server of the live page on real sockets: dead, slow and many browsers cost nothing, and all of it ends."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator
from contextlib import ExitStack
from types import SimpleNamespace

import pytest
from browsers import Page, frame

from fbvm.live.host import LiveHost
from fbvm.live.sockets import IDLE_SERVES, MOST_CONNECTIONS
from fbvm.live.updates import UPDATE_NS

WAIT_NS = 2_000_000_000


@pytest.fixture
def host() -> Iterator[LiveHost]:
    made = LiveHost(Page().bench, token="t")
    yield made
    made.close()


def called(host: LiveHost) -> socket.socket:
    """A browser's socket, accepted by the server."""
    made = socket.create_connection(("127.0.0.1", host.server.guard.port))
    host.serve(WAIT_NS)
    return made


def opened(host: LiveHost) -> socket.socket:
    """A browser's socket whose WebSocket is open and whose page has said hello."""
    sock, name = called(host), f"127.0.0.1:{host.server.guard.port}"
    sock.sendall(f"GET /live?token=t HTTP/1.1\r\nHost: {name}\r\nOrigin: http://{name}\r\n"
                 "Upgrade: websocket\r\nConnection: Upgrade\r\n"
                 "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n".encode())  # fmt: skip
    host.serve(WAIT_NS)
    assert sock.recv(4096).startswith(b"HTTP/1.1 101 ")
    sock.sendall(frame(json.dumps({"id": 1, "do": "hello"}).encode()))
    host.serve(WAIT_NS)
    return sock


def test_a_page_is_opened_and_asks(host: LiveHost) -> None:
    with opened(host) as sock:
        assert b'"re":1' in sock.recv(65536)
        assert len(host.server.sessions) == 1
        [browser] = host.server._browsers
        assert browser.sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY), "small updates do not wait for one another"


def test_a_browser_that_goes_without_a_word_is_forgotten(host: LiveHost) -> None:
    with opened(host) as sock:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
    host.serve(WAIT_NS)
    assert host.server.sessions == []


def test_a_browser_that_never_reads_gets_one_update_and_holds_nothing_up(host: LiveHost) -> None:
    with opened(host):
        live = host.workbench.plcs["pump"]
        for number in range(1, 200):
            live.plc.scan()
            host.update(number * UPDATE_NS, lambda: False)
        assert len(host.server.sessions) == 1


def asked(host: LiveHost, sock: socket.socket, do: str, **fields: object) -> None:
    sock.sendall(frame(json.dumps({"id": 2, "do": do, **fields}).encode()))
    host.serve(WAIT_NS)


def test_what_a_page_holds_is_let_go_when_the_page_goes(host: LiveHost) -> None:
    """As soon as a scan has seen it, and not while a debugger has the PLC; what the page has let go itself is left alone."""
    plc = host.workbench.plcs["pump"].plc
    with opened(host) as sock:
        asked(host, sock, "write", plc="pump", name="Main.Pump", value="TRUE", held=True)
        plc.scan()
    host.workbench.held_by = "a debugger"
    host.serve(WAIT_NS)
    host.update(0, lambda: False)
    assert host.server.sessions == [] and plc.read("Main.Pump") is True
    host.workbench.held_by = ""
    host.update(0, lambda: False)
    assert plc.read("Main.Pump") is False
    with opened(host) as sock:
        asked(host, sock, "write", plc="pump", name="Main.Pump", value="TRUE", held=True)
        asked(host, sock, "write", plc="pump", name="Main.Pump", value="FALSE")
        asked(host, sock, "write", plc="pump", name="Main.Pump", value="TRUE")
    host.serve(WAIT_NS)
    plc.scan()
    host.update(0, lambda: False)
    assert plc.read("Main.Pump") is True, "written, and not held"


def test_callers_who_say_nothing_are_sent_away(host: LiveHost) -> None:
    with called(host) as sock:
        sock.settimeout(5)
        for _ in range(IDLE_SERVES + 1):
            host.serve(0)
        assert sock.recv(10) == b""


def test_callers_who_say_nothing_keep_no_page_out(host: LiveHost) -> None:
    callers = [called(host) for _ in range(MOST_CONNECTIONS)]
    try:
        with opened(host):
            assert len(host.server.sessions) == 1
        callers[0].settimeout(5)
        assert callers[0].recv(10) == b"", "the oldest of them made room"
    finally:
        for caller in callers:
            caller.close()


def test_there_are_so_many_pages_and_no_more(host: LiveHost) -> None:
    with ExitStack() as stack:
        for _ in range(MOST_CONNECTIONS):
            stack.enter_context(opened(host))
        late = stack.enter_context(called(host))
        late.settimeout(5)
        assert late.recv(10) == b"" and len(host.server.sessions) == MOST_CONNECTIONS


def test_who_hangs_up_inside_a_request_leaves_nothing(host: LiveHost) -> None:
    with called(host) as sock:
        sock.sendall(b"GET / HT")
        host.serve(WAIT_NS)
    host.serve(WAIT_NS)
    host.serve(0)
    with opened(host):
        assert len(host.server.sessions) == 1


def test_a_file_comes_whole_over_a_socket(host: LiveHost) -> None:
    with called(host) as sock:
        sock.settimeout(5)
        sock.sendall(f"GET /main.js HTTP/1.1\r\nHost: localhost:{host.server.guard.port}\r\n\r\n".encode())
        host.serve(WAIT_NS)
        answer = b""
        while piece := sock.recv(65536):
            answer += piece
            host.serve(0)
    head, _, body = answer.partition(b"\r\n\r\n")
    assert f"Content-Length: {len(body)}".encode() in head and body.endswith(b"new Page();\n")


def test_pages_are_told_that_fbvm_has_ended() -> None:
    host = LiveHost(Page().bench, token="t")
    with opened(host) as sock, called(host) as waiting:
        for one in (sock, waiting):
            one.settimeout(5)
        assert b'"re":1' in sock.recv(65536)
        host.close()
        told = sock.recv(65536)
        assert told[0] == 0x88 and b"fbvm has ended" in told and sock.recv(10) == b"" and waiting.recv(10) == b""
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", host.server.guard.port))


def test_a_browser_that_never_reads_is_left_at_the_end() -> None:
    host = LiveHost(Page().bench, token="t")
    with opened(host) as sock:
        [browser] = host.server._browsers
        browser.connection._out += bytes(8 << 20)
        host.close()
        assert host.server.sessions == [] and browser.sock.fileno() == -1 and sock.fileno() != -1


def test_pages_that_are_open_begin_again_with_other_plcs(host: LiveHost) -> None:
    with opened(host) as sock:
        sock.settimeout(5)
        assert b'"re":1' in sock.recv(65536)
        other = Page().bench
        host.show(other)
        [session] = host.server.sessions
        assert session.live is other.plcs["pump"]
        host.update(UPDATE_NS, lambda: False)
        assert b'{"update":{"restarted":true}}' in sock.recv(65536)
        other.control.pause()
        host.after_scan(0, 0)
        assert host.address.startswith(f"http://127.0.0.1:{host.server.guard.port}/") and "token=t" in host.address


def test_who_had_no_turn_is_the_first_at_the_next(host: LiveHost) -> None:
    with opened(host) as one, opened(host) as two:
        for sock in (one, two):
            sock.settimeout(5)
            sock.recv(65536)
        first, second = host.server.sessions
        host.update(UPDATE_NS, lambda: True)
        while first.is_behind:
            host.update(UPDATE_NS, lambda: True)
        assert b'"update"' in one.recv(65536) and host.server.sessions == [second, first]


def test_once_in_100_ms_the_run_ticks_and_every_300_files_are_looked_at() -> None:
    ticks: list[str] = []
    page = Page()
    page.bench.changes = SimpleNamespace(look=lambda: ticks.append("look"), step=lambda: ticks.append("step"))  # type: ignore[assignment]
    host = LiveHost(page.bench, token="t", tick=lambda: ticks.append("tick"))
    try:
        for number in range(1, 14):
            host.update(number * UPDATE_NS // 2, lambda: False)
        assert ticks == ["tick", "tick", "tick", "look", "tick", "tick", "tick", "look"]
        host.serve(0)
        assert ticks[-1] == "step"
    finally:
        host.close()
