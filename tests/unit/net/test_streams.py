"""Streams between programs of this computer: bytes both ways, and their end for whoever waits."""

from __future__ import annotations

import pytest

from fbvm.net.streams import Listener, connect


def test_bytes_go_both_ways_until_one_side_ends() -> None:
    door = Listener("127.0.0.1", 0)
    with connect("127.0.0.1", door.port) as here:
        there = door.accept()
        here.send(b"asks")
        assert there.receive() == b"asks"
        there.send(b"answers")
        assert here.receive() == b"answers"
        here.end()
        assert there.receive() == b"" == here.receive()
        with pytest.raises(BrokenPipeError):
            here.send(b"more")
        there.close()
        with pytest.raises(OSError, match=r".+"):
            there.receive()
    with pytest.raises(OSError, match=r".+"):
        here.receive()
    port = door.port
    door.close()
    with pytest.raises(ConnectionRefusedError):
        connect("127.0.0.1", port)


def test_a_port_in_use_is_refused() -> None:
    door = Listener("127.0.0.1", 0)
    with pytest.raises(OSError, match=r".+"):
        Listener("127.0.0.1", door.port)
    door.close()


def test_a_stream_that_is_closed_has_ended_for_the_other_side_whoever_holds_its_socket() -> None:
    listener = Listener("127.0.0.1", 0)
    try:
        stream = connect("127.0.0.1", listener.port)
        with listener.accept() as other, stream._connection.dup():
            other._connection.settimeout(5)
            stream.close()
            assert other.receive() == b""
    finally:
        listener.close()
