"""Room for deep recursion, which all threads share."""

from __future__ import annotations

import sys
from threading import Thread

import pytest

from fbvm.code.recursion import keep_room, room, with_room


@pytest.fixture
def usual() -> int:
    """The limit outside."""
    return sys.getrecursionlimit()


def deep(frames: int) -> int:
    return deep(frames - 1) if frames else sys.getrecursionlimit()


def elsewhere(frames: int) -> None:
    """Another thread has so much room, and has ended."""
    def work() -> None:
        with room(frames):
            pass

    thread = Thread(target=work)
    thread.start()
    thread.join()


def test_room_lasts_as_long_as_its_block(usual: int) -> None:
    with room(usual + 5_000):
        assert deep(usual + 1_000) == usual + 5_000
        with room(10):
            assert sys.getrecursionlimit() == usual + 5_000
        assert sys.getrecursionlimit() == usual + 5_000
    assert sys.getrecursionlimit() == usual


def test_what_another_thread_leaves_stays_while_one_is_within(usual: int) -> None:
    """A limit that falls below the depth of a thread ends the process."""
    with room(usual + 5_000):
        elsewhere(usual + 9_000)
        assert sys.getrecursionlimit() >= usual + 5_000
        assert deep(usual + 1_000)
    assert sys.getrecursionlimit() == usual


def test_work_that_is_tried_without_more_room_may_be_as_deep_as_another_thread_lets_it(usual: int) -> None:
    seen: list[int] = []

    def work() -> None:
        elsewhere(usual + 9_000)
        seen.append(sys.getrecursionlimit())

    with_room(work, lambda: 0)
    assert seen == [usual + 9_000] and sys.getrecursionlimit() == usual


def test_work_that_is_too_deep_is_done_once_more(usual: int) -> None:
    tries: list[int] = []

    def work() -> int:
        tries.append(sys.getrecursionlimit())
        return deep(usual + 1_000)

    assert with_room(work, lambda: usual + 5_000) == usual + 5_000
    assert tries == [usual, usual + 5_000] and sys.getrecursionlimit() == usual


def test_room_that_is_kept_stays(usual: int) -> None:
    try:
        with room(usual + 10):
            keep_room(usual + 20)
        assert sys.getrecursionlimit() == usual + 20
        keep_room(usual)
        assert sys.getrecursionlimit() == usual + 20
    finally:
        sys.setrecursionlimit(usual)
