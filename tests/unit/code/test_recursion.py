"""Room for deep recursion, which all threads share."""

from __future__ import annotations

import sys
from threading import Event, Thread

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


def test_work_that_is_too_deep_is_done_once_more(usual: int) -> None:
    tries: list[int] = []

    def work() -> int:
        tries.append(sys.getrecursionlimit())
        return deep(usual + 1_000)

    assert with_room(work, lambda: usual + 5_000) == usual + 5_000
    assert tries == [usual, usual + 5_000] and sys.getrecursionlimit() == usual


@pytest.mark.parametrize("frames", [0, 800])
def test_the_limit_falls_while_another_thread_works_unless_that_is_deep(frames: int, usual: int) -> None:
    ready, end = Event(), Event()

    def wait(more: int) -> None:
        if more:
            wait(more - 1)
        else:
            ready.set()
            end.wait()

    with room(usual + 5_000):
        thread = Thread(target=lambda: with_room(lambda: wait(frames * usual // 1_000), lambda: 0))
        thread.start()
        ready.wait()
    assert sys.getrecursionlimit() == (usual + 5_000 if frames else usual)
    with room(usual + 4_000):
        end.set()
        thread.join()
        assert sys.getrecursionlimit() >= usual + 4_000
    assert sys.getrecursionlimit() == usual


def test_a_limit_that_somebody_else_sets_meanwhile_is_left_alone(usual: int) -> None:
    try:
        for frames in (0, usual + 5_000):
            with room(frames):
                sys.setrecursionlimit(usual + 300)
            assert sys.getrecursionlimit() == usual + 300
            with room(0):
                sys.setrecursionlimit(usual)
            assert sys.getrecursionlimit() == usual
    finally:
        sys.setrecursionlimit(usual)


def test_room_that_is_kept_stays(usual: int) -> None:
    try:
        with room(usual + 10):
            keep_room(usual + 20)
        assert sys.getrecursionlimit() == usual + 20
        keep_room(usual)
        assert sys.getrecursionlimit() == usual + 20
    finally:
        sys.setrecursionlimit(usual)
