"""The helper process of the compiler: it optimises modules while this process goes on scanning, and ends with this process.

To optimise a large program takes seconds.  In this process that would block LLVM for all other modules and could not be broken
off.  One thread waits for the answers."""

from __future__ import annotations

import atexit
import os
import subprocess
import sys
import threading
from collections import deque
from contextlib import suppress
from typing import IO, Protocol
from weakref import ref

from fbvm.base.host import give_way
from fbvm.engine.apart import DEAF, run_apart
from fbvm.engine.native.llvm.compiler import compile_text, search_less

COMPILER = "fbvm compiler"
"""The name of the thread that waits for the helper process."""
_SIZE_BYTES = 8
LONGEST_HERE = {0: 4 << 20, 1: 1 << 20, 2: 1 << 19}
"""Characters of the text of a module, by level of optimisation, that LLVM compiles in half a second."""


def _program(call: str) -> str:
    """The program of a process that calls a function of this module with the bytes of its standard input and output."""
    return (f"import sys; sys.path[:] = {sys.path!r}\n"
            f"from fbvm.engine.native.llvm import worker\nworker.{call.format('sys.stdin.buffer, sys.stdout.buffer')}")


def serve(jobs: IO[bytes], answers: IO[bytes], large: bool = False) -> None:
    """Runs in the helper process: compiles one module after the other until `jobs` ends.  All are `large`, or none is.

    A job is the size of a text in eight bytes, and the text of a module; an answer the size of an object file, and the object
    file, which is empty if the compilation failed.  Scans, of this PLC and others, come first."""
    give_way()
    if large:
        search_less()
    while len(head := jobs.read(_SIZE_BYTES)) == _SIZE_BYTES:
        text = jobs.read(int.from_bytes(head, "little")).decode()
        try:
            compiled = compile_text(text, 2)
        except RuntimeError:
            compiled = b""
        answers.write(len(compiled).to_bytes(_SIZE_BYTES, "little") + compiled)
        answers.flush()


def compile_apart(text: str, level: int) -> bytes:
    """Compiles the text of a module as `compile_text` does, in a process of its own if it is large, so that Ctrl-C ends it."""
    made = None
    if len(text) > LONGEST_HERE[level]:
        made = run_apart(_program(f"serve_one({{}}, {level})"), text.encode())
    return made or compile_text(text, level)


def serve_one(job: IO[bytes], answer: IO[bytes], level: int) -> None:
    """Runs in the process of `compile_apart`: compiles one large module."""
    search_less()
    answer.write(compile_text(job.read().decode(), level))


class Job(Protocol):
    """What wants a module optimised; both are called in the thread."""

    def job_text(self) -> str:
        """The text of the module."""

    def improve(self, compiled: bytes) -> None:
        """Takes the object file."""


class Worker:
    """Gives jobs to the helper process, which is started with the first job.

    A job that nobody holds any more when its turn comes is left out: programs whose PLCs are gone keep no other waiting."""

    def __init__(self) -> None:
        self._jobs: deque[ref[Job]] = deque()
        self._lock = threading.Lock()
        self._busy = False
        self._process: subprocess.Popen[bytes] | None = None
        self._large = False
        self._owner = os.getpid()

    def compile(self, job: Job) -> None:
        """Has a module optimised.  If the helper process, or the thread that waits for it, cannot be started or dies, the job is
        never told."""
        with self._lock:
            self._jobs.append(ref(job))
            if not self._busy:
                try:
                    threading.Thread(target=self._work, name=COMPILER, daemon=True).start()
                except RuntimeError:  # the system has no more threads for this process
                    self._jobs.clear()
                else:
                    self._busy = True

    def _work(self) -> None:
        while True:
            with self._lock:
                if not self._jobs:
                    self._busy = False
                    return
                job = self._jobs.popleft()()
            if job:
                compiled = self._answer(job.job_text().encode())
                if compiled:
                    job.improve(compiled)
            del job

    def _answer(self, text: bytes) -> bytes:
        try:
            process = self._started(len(text) > LONGEST_HERE[2])
            assert process.stdin and process.stdout
            process.stdin.write(len(text).to_bytes(_SIZE_BYTES, "little") + text)
            process.stdin.flush()
            head = process.stdout.read(_SIZE_BYTES)
            return process.stdout.read(int.from_bytes(head, "little")) if len(head) == _SIZE_BYTES else b""
        except (OSError, ValueError):
            return b""

    def _started(self, large: bool = False) -> subprocess.Popen[bytes]:
        """The helper process for large modules, or the one for others: options of LLVM are those of a whole process."""
        if large is not self._large:
            self.stop()
            self._large = large
        process = self._process  # which `stop` may take away meanwhile
        if process is None or process.poll() is not None or self._owner != os.getpid():
            command = [sys.executable, "-c", DEAF + _program(f"serve({{}}, {large})")]
            process = self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                                       stderr=subprocess.DEVNULL)
            self._owner = os.getpid()
            atexit.register(self.stop)
        return process

    def stop(self) -> None:
        """Ends the helper process, whatever it is doing."""
        process, self._process = self._process, None
        if process is None or self._owner != os.getpid():
            return
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            if pipe:
                with suppress(BrokenPipeError):  # what the compiler was being told when it was ended
                    pipe.close()


worker = Worker()
