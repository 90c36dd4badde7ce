"""Tries mutants in forks of one session of pytest, which has imported fbvm and collected all tests once.

A mutant within functions is put into their code; one of a table, a class or a default value is left to a new process, since
others may hold copies of what was made of it.  What was kept by a cache when the tests were collected keeps what it is, too, so
that a mutant that is not found here is to be tried in a new process.  For a file of a library in ST, what has been kept of
libraries and of programs is forgotten in the fork.  POSIX only."""

from __future__ import annotations

import gc
import json
import os
import resource
import signal
import socket
import subprocess
import sys
import time
import types
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import _lru_cache_wrapper, cache, partial
from pathlib import Path
from typing import Any

import pytest

SOCKET = "FBVM_MUTANTS_SOCKET"
"""The environment variable with the number of the socket on which the session is asked."""
WAITING = 10
"""Times the processor time that tests may take in real time."""
OF_LIBRARIES = ("fbvm.base.cache", "fbvm.check", "fbvm.code.store", "fbvm.interchange.plcopen.read.scope", "fbvm.processor")
"""The modules whose caches keep something of a library."""


class Forked:
    """A session of pytest in a copy of the repository that is asked about mutants."""

    def __init__(self, folder: Path, environment: dict[str, str]) -> None:
        own, other = socket.socketpair()
        path = os.pathsep.join([str(Path(__file__).parent), environment["PYTHONPATH"]])
        pytest_args = ["-q", "-p", "forked", "-p", "no:cacheprovider", "-p", "no:xdist"]
        self._running = subprocess.Popen([sys.executable, "-m", "pytest", *pytest_args], cwd=folder, pass_fds=[other.fileno()],
                                         env={**environment, "PYTHONPATH": path, SOCKET: str(other.fileno())},
                                         stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        other.close()
        self._socket, self._answers = own, own.makefile(encoding="utf-8")
        self._answer()  # all sources have been imported

    def failure(self, path: Path, then: str, now: str, tests: list[str], marks: str, most: int,
                limit_s: int) -> str | None:  # fmt: skip
        """Which of the tests, of those with a name `most` with these marks, fails first if a source has another text.

        None if all pass; "" if it took too long.

        Raises NotImplementedError for a change outside of functions, and RuntimeError if the session has ended."""
        question = {"path": path.as_posix(), "then": then, "now": now, "tests": tests, "slow": marks == "slow",
                    "most": most, "limit_s": limit_s}  # fmt: skip
        self._socket.sendall((json.dumps(question) + "\n").encode())
        found = self._answer()
        if not found["is_within_functions"]:
            raise NotImplementedError(path)
        failed: str | None = found["failed"]
        return failed

    def _answer(self) -> dict[str, Any]:
        line = self._answers.readline()
        if not line:
            raise RuntimeError("the session of pytest in which mutants are tried has ended")
        answer: dict[str, Any] = json.loads(line)
        return answer

    def close(self) -> None:
        """Ends the session."""
        self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()
        with suppress(subprocess.TimeoutExpired):
            self._running.wait(10)
        self._running.kill()
        self._running.wait()


# --- within the session -----------------------------------------------------------------------------------------------


@pytest.hookimpl(tryfirst=True)
def pytest_collection() -> None:
    """Properties end at the first example that fails: to look for a smaller one takes most of the time of a mutant."""
    from hypothesis import Phase, settings

    settings.register_profile("first failure", settings.get_profile("quick"), phases=[Phase.explicit, Phase.generate])
    settings.load_profile("first failure")


@pytest.hookimpl(tryfirst=True)
def pytest_runtestloop(session: pytest.Session) -> bool | None:
    """Answers what is asked in place of running the tests."""
    if SOCKET not in os.environ:
        return None
    asked = socket.socket(fileno=int(os.environ.pop(SOCKET)))
    _parse_libraries()
    functions, caches = _functions(Path.cwd()), _caches(Path.cwd())
    gc.freeze()
    with asked, asked.makefile(encoding="utf-8") as questions:
        asked.sendall(b"{}\n")
        for line in questions:
            asked.sendall((json.dumps(_answer(session.items, functions, caches, json.loads(line))) + "\n").encode())
    return True


def _parse_libraries() -> None:
    """Parses the shipped libraries.  A tree is kept by its text, so that only a changed file is parsed in a fork."""
    from fbvm.check.symbols import library

    library._parsed = cache(library._parsed.__wrapped__)
    for one in library._shipped():
        for path in one.files.values():
            library._file(one.name, path)


def _caches(folder: Path) -> list[_lru_cache_wrapper[Any]]:
    """The functions with a cache of what a library's file says."""
    from fbvm.check.symbols import library

    tests = str(folder / "tests")
    files = {name: str(getattr(module, "__file__", "")) for name, module in sys.modules.items()}
    return [one for one in gc.get_objects() if isinstance(one, _lru_cache_wrapper) and one is not library._parsed
            and (one.__module__.startswith(OF_LIBRARIES) or files.get(one.__module__, "").startswith(tests))]


Key = tuple[str, str, int]
"""File, qualified name and first line of a piece of code."""


def _functions(folder: Path) -> dict[Key, list[types.FunctionType]]:
    found: dict[Key, list[types.FunctionType]] = {}
    gc.unfreeze()  # what is frozen is not among the objects
    for one in gc.get_objects():
        if isinstance(one, types.FunctionType) and one.__code__.co_filename.startswith(str(folder)):
            found.setdefault(_key(one.__code__), []).append(one)
    return found


def _key(code: types.CodeType) -> Key:
    return code.co_filename, code.co_qualname, code.co_firstlineno


def _answer(items: list[pytest.Item], functions: dict[Key, list[types.FunctionType]], caches: list[_lru_cache_wrapper[Any]],
            question: dict[str, Any]) -> dict[str, Any]:
    file = str(Path.cwd() / question["path"])
    chosen = _chosen(items, question["tests"], question["slow"], question["most"])
    if not file.endswith(".py"):
        return {"is_within_functions": True, "failed": _in_fork(chosen, partial(_forget, caches), question["limit_s"])}
    changed = list(_changed(*(compile(question[name], file, "exec", dont_inherit=True) for name in ("then", "now"))))
    if any(new is None for _, new in changed):
        return {"is_within_functions": False, "failed": ""}
    return {"is_within_functions": True, "failed": _in_fork(chosen, partial(_put, changed, functions), question["limit_s"])}


def _forget(caches: list[_lru_cache_wrapper[Any]]) -> None:
    for one in caches:
        one.cache_clear()


def _put(changed: list[Change], functions: dict[Key, list[types.FunctionType]]) -> None:
    for old, new in changed:
        for function in functions.get(_key(old), ()):
            assert new is not None
            function.__code__ = new


Change = tuple[types.CodeType, types.CodeType | None]


def _changed(old: types.CodeType, new: types.CodeType) -> Iterator[Change]:
    """The pieces of code of functions that differ, each with its new one; None for one that is no function's own."""
    inner = [[each for each in code.co_consts if isinstance(each, types.CodeType)] for code in (old, new)]
    own = _own(old) == _own(new)
    if old.co_flags & 1:  # CO_OPTIMIZED: a function
        if old != new:
            yield old, new if old.co_freevars == new.co_freevars else None
    elif not own or len(inner[0]) != len(inner[1]):
        yield old, None
    for one, other in zip(*inner, strict=False):
        yield from _changed(one, other)


def _own(code: types.CodeType) -> tuple[object, ...]:
    """What a piece of code does itself, without the functions in it."""
    constants = tuple(None if isinstance(each, types.CodeType) else (type(each), repr(each)) for each in code.co_consts)
    return code.co_code, constants, code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars


def _chosen(items: list[pytest.Item], tests: list[str], slow: bool, most: int) -> list[pytest.Item]:
    order = {test: number for number, test in enumerate(tests)}
    ranked = [(rank, item) for item in items if (item.get_closest_marker("slow") is not None) == slow
              and (rank := order.get(item.nodeid, order.get(item.nodeid.partition("::")[0]))) is not None]
    chosen = [item for _, item in sorted(ranked, key=lambda one: one[0])]
    left_out = {item.nodeid for item in [item for item in chosen if item.nodeid in order][most:]}
    return [item for item in chosen if item.nodeid not in left_out]


def _in_fork(items: list[pytest.Item], change: Callable[[], None], limit_s: int) -> str | None:
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        _run(items, change, limit_s, writing)
    os.close(writing)
    status = _waited(child, limit_s * WAITING)
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(child, signal.SIGKILL)
    with os.fdopen(reading, encoding="utf-8") as said:
        failed = said.read() if status is not None else ""
    return None if status == 0 else failed


def _run(items: list[pytest.Item], change: Callable[[], None], limit_s: int, writing: int) -> None:
    """Makes the change, runs the tests until one fails, and ends the process."""
    from _pytest.runner import runtestprotocol

    status = 1
    try:
        os.setsid()
        resource.setrlimit(resource.RLIMIT_CPU, (limit_s, limit_s))
        change()
        for item, following in zip(items, [*items[1:], None], strict=True):
            if any(report.failed for report in runtestprotocol(item, nextitem=following, log=False)):
                os.write(writing, item.nodeid.encode())
                break
        else:
            status = 0
    finally:
        os._exit(status)


def _waited(child: int, limit_s: float) -> int | None:
    """The status with which a process ends; None if it does not within the time."""
    until = time.monotonic() + limit_s
    while time.monotonic() < until:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            return status
        time.sleep(0.01)
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return None
