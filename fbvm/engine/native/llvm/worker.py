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
from collections.abc import Callable
from contextlib import suppress
from typing import IO

_SIZE_BYTES = 8


def serve(jobs: IO[bytes], answers: IO[bytes]) -> None:
    """Runs in the helper process: compiles one module after the other until `jobs` ends.

    A job is the size of a text in eight bytes, and the text of a module; an answer the size of an object file, and the object
    file, which is empty if the compilation failed."""
    from fbvm.engine.native.llvm.compiler import compile_text

    while len(head := jobs.read(_SIZE_BYTES)) == _SIZE_BYTES:
        text = jobs.read(int.from_bytes(head, "little")).decode()
        try:
            compiled = compile_text(text, 2)
        except RuntimeError:
            compiled = b""
        answers.write(len(compiled).to_bytes(_SIZE_BYTES, "little") + compiled)
        answers.flush()


class Worker:
    """Gives jobs to the helper process, which is started with the first job."""

    def __init__(self) -> None:
        self._jobs: deque[tuple[Callable[[], str], Callable[[bytes], None]]] = deque()
        self._lock = threading.Lock()
        self._busy = False
        self._process: subprocess.Popen[bytes] | None = None
        self._owner = os.getpid()

    def compile(self, text: Callable[[], str], done: Callable[[bytes], None]) -> None:
        """Has a module optimised.  `text` returns its text and `done` takes its object file; both are called in the thread.

        If the helper process cannot be started or dies, `done` is never called."""
        with self._lock:
            self._jobs.append((text, done))
            if not self._busy:
                self._busy = True
                threading.Thread(target=self._work, name="fbvm compiler", daemon=True).start()

    def _work(self) -> None:
        while True:
            with self._lock:
                if not self._jobs:
                    self._busy = False
                    return
                text, done = self._jobs.popleft()
            compiled = self._answer(text().encode())
            if compiled:
                done(compiled)

    def _answer(self, text: bytes) -> bytes:
        try:
            process = self._started()
            assert process.stdin and process.stdout
            process.stdin.write(len(text).to_bytes(_SIZE_BYTES, "little") + text)
            process.stdin.flush()
            head = process.stdout.read(_SIZE_BYTES)
            return process.stdout.read(int.from_bytes(head, "little")) if len(head) == _SIZE_BYTES else b""
        except (OSError, ValueError):
            return b""

    def _started(self) -> subprocess.Popen[bytes]:
        process = self._process  # which `stop` may take away meanwhile
        if process is None or process.poll() is not None or self._owner != os.getpid():
            program = (f"import sys; sys.path[:] = {sys.path!r}\n"
                       "from fbvm.engine.native.llvm.worker import serve\nserve(sys.stdin.buffer, sys.stdout.buffer)")
            process = self._process = subprocess.Popen([sys.executable, "-c", program], stdin=subprocess.PIPE,
                                                       stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
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
