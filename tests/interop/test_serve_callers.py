"""`fbvm serve` and many callers: together, one after the other at once, and more than there are sockets."""

from __future__ import annotations

import socket
import threading

import pytest
from depth import times
from received import heard
from test_etn_server_serve import service

from fbvm.wire import modbus
from fbvm.wire.modbus import Adu

pytestmark = pytest.mark.slow
ASK = Adu(1, 1, modbus.read(3, 0, 1)).to_bytes()
REPLY = Adu(1, 1, b"\3\2\0\0").to_bytes()
BOUND_S = 20.0


def answered(port: int, together: threading.Barrier, held: list[socket.socket], ends: list[str]) -> None:
    """One client: connects with the others, asks, and keeps its connection."""
    sock = socket.socket()
    sock.settimeout(BOUND_S)
    held.append(sock)
    together.wait()
    try:
        sock.connect(("127.0.0.1", port))
        sock.sendall(ASK)
        ends.append("served" if heard(sock, len(REPLY)) == REPLY else "closed")
    except OSError as error:
        ends.append(type(error).__name__)


@pytest.mark.parametrize("count", [2, 5, 8])
def test_clients_that_connect_at_the_same_moment_are_all_served(count: int) -> None:
    with service("--sockets", "8") as there:
        for _ in range(times(20)):
            together, held, ends = threading.Barrier(count), list[socket.socket](), list[str]()
            clients = [threading.Thread(target=answered, args=(there.port, together, held, ends)) for _ in range(count)]
            for client in clients:
                client.start()
            for client in clients:
                client.join()
            for sock in held:
                sock.close()
            assert ends == ["served"] * count


def test_a_client_that_comes_back_at_once_is_let_in() -> None:
    """Its one socket has just been closed and is being opened again."""
    with service() as there:
        for _ in range(times(200)):
            assert there.ask(modbus.read(3, 0, 1)) == [b"\3\2\0\0"]
            with socket.create_connection(("127.0.0.1", there.port), BOUND_S) as sock:
                sock.sendall(ASK)
                assert heard(sock, len(REPLY)) == REPLY


def test_who_is_above_the_table_waits_for_a_place() -> None:
    with service("--sockets", "2") as there:
        clients = [socket.create_connection(("127.0.0.1", there.port), BOUND_S) for _ in range(5)]
        for client in clients:
            client.sendall(ASK)
        for client in clients[:2]:
            assert heard(client, len(REPLY)) == REPLY
        for waiting in clients[2:]:
            waiting.settimeout(0.05)
            with pytest.raises(TimeoutError):
                waiting.recv(1)
            waiting.settimeout(BOUND_S)
        for leaving, next_one in zip(clients, clients[2:], strict=False):
            leaving.close()
            assert heard(next_one, len(REPLY)) == REPLY
        for client in clients:
            client.close()


def test_without_a_backlog_a_second_client_is_refused() -> None:
    """As by the unit, whose one socket is taken."""
    with service("--no-backlog") as there, socket.create_connection(("127.0.0.1", there.port), BOUND_S) as first:
        first.sendall(ASK)
        assert heard(first, len(REPLY)) == REPLY
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection(("127.0.0.1", there.port), BOUND_S)
