"""The vocabulary between units and networks: endpoints as they are written, and what a request means that says no more."""

from __future__ import annotations

from typing import Any

import pytest
from rows import each_of

from fbvm.wire.link import Close, Connect, Listen, Peer, Received, read_peer
from fbvm.wire.tap import TapEvent, TapKind

ANY = Peer("0.0.0.0", 0)


@each_of(("host", "port"), [("0.0.0.0", 0), ("192.168.250.1", 502), ("255.255.255.255", 65535)])
def test_an_endpoint_of_a_file(host: str, port: int) -> None:
    assert read_peer(host, port) == Peer(host, port) and str(Peer(host, port)) == f"{host}:{port}"


@each_of(("host", "port", "said"), [
    ("1.2.3.4", -1, "-1 is no port"), ("1.2.3.4", 65536, "65536 is no port"), ("1.2.3.4", True, "True is no port"),
    ("1.2.3.4", "502", "'502' is no port"), ("1.2.3.4", 502.0, "502.0 is no port"), ("1.2.3", 502, "1.2.3"),
    ("here", 502, "here"), (None, 502, "None"),
])  # fmt: skip
def test_what_is_no_endpoint_is_refused(host: Any, port: Any, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        read_peer(host, port)


def test_who_says_no_more_means_anybody_and_an_orderly_end() -> None:
    assert (Listen(1, 502).remote, Listen(1, 502).keep_alive, Received(1, b"").remote) == (ANY, False, ANY)
    assert (Connect(1, ANY).local_port, Connect(1, ANY).keep_alive, Close(1).reset) == (0, False, False)


def test_an_event_of_a_connection_in_words() -> None:
    one, other = Peer("10.0.0.1", 1025), Peer("10.0.0.2", 502)
    assert str(TapEvent(TapKind.DATA, one, other, True, b"\x01\xab")) == "data 10.0.0.1:1025 -> 10.0.0.2:502 01 AB"
    assert str(TapEvent(TapKind.FIN, one, other, False)) == "fin 10.0.0.1:1025 <- 10.0.0.2:502"
    assert not TapEvent(TapKind.FIN, one, other, False).mirrored
