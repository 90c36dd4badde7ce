"""How serving a client ends: by its wish, without it, in the middle of a message, or with bytes that are none."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable

import pytest

from fbvm.dap.framing import encode
from fbvm.dap.server import DebugDoor, pass_on, serve_until_ended
from fbvm.dap.target import LaunchError, Target


def refuse(how: str, arguments: object) -> Target:
    raise LaunchError("nothing can be debugged here")


def asked(command: str, **arguments: object) -> bytes:
    return encode({"seq": 1, "type": "request", "command": command, "arguments": arguments})


def gone(data: bytes) -> None:
    raise BrokenPipeError


def keep(data: bytes) -> None:
    """Takes what is written."""


@pytest.mark.parametrize(("pieces", "write", "ended"), [
    ([asked("disconnect", terminateDebuggee=True)], keep, ("", True)), ([asked("disconnect")], keep, ("", False)),
    ([asked("initialize")], keep, ("", False)), ([], keep, ("", False)), ([asked("initialize")], gone, ("", False)),
    ([asked("initialize")[:-3]], keep, ("the client is gone in the middle of a message", False)),
    ([b"Content-Length: x\r\n\r\n"], keep, ("no length of a message: x", False)),
    ([b"Content-Length: 16777217\r\n\r\n"], keep, ("no length of a message: 16777217", False)),
    ([b"Content-Length: 16777216\r\n\r\n"], keep, ("the client is gone in the middle of a message", False)),
    ([asked("disconnect", terminateDebuggee=True)[:9], asked("disconnect", terminateDebuggee=True)[9:]], keep, ("", True)),
])  # fmt: skip
def test_how_serving_a_client_ends(pieces: list[bytes], write: Callable[[bytes], None], ended: tuple[str, bool]) -> None:
    waiting = iter([*pieces, b""])
    assert serve_until_ended(refuse, lambda: next(waiting), write) == ended


def test_a_client_that_says_nothing_is_left_when_somebody_says_so() -> None:
    looks: list[int] = []

    def meanwhile() -> bool:
        looks.append(1)
        return len(looks) == 2

    def never() -> bytes:
        raise OSError  # the connection fails, and nothing more comes

    left = threading.Event()

    def silent() -> bytes:
        return b"" if left.wait(10) else asked("disconnect", terminateDebuggee=True)

    assert serve_until_ended(refuse, silent, keep, lambda: True) == ("", False)
    left.set()
    assert serve_until_ended(refuse, never, keep, meanwhile) == ("", False)


@pytest.mark.parametrize("ends", [True, False])
def test_a_door_serves_one_caller_after_another_until_nobody_can_call_any_more(ends: bool) -> None:
    closed: list[int] = []
    calls = iter([1, 2])
    came = threading.Event()

    def accept() -> tuple[Callable[[], bytes], Callable[[bytes], None], Callable[[], None]]:
        number = next(calls, 0)
        if not number:
            came.set()
            raise OSError
        said = iter([asked("disconnect", terminateDebuggee=ends), b""])
        return lambda: next(said), keep, lambda: closed.append(number)

    door = DebugDoor(accept)
    assert came.wait(10) and door.is_called
    assert [door.serve(refuse), door.serve(refuse)] == [ends, ends] and closed == [1, 2]
    assert not door.is_called and door.serve(refuse) is False


def test_a_bridge_passes_on_what_comes_from_both_sides_up_to_the_end() -> None:
    answers: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    said, heard, written = iter([b"one", b"two", b""]), list[bytes](), bytearray()

    def send(data: bytes) -> None:
        heard.append(data)
        answers.put(b"re: " + data + b";")

    pass_on(lambda: next(said), written.extend, lambda: answers.get(timeout=10), send, lambda: answers.put(b""))
    assert (heard, bytes(written)) == ([b"one", b"two"], b"re: one;re: two;")
