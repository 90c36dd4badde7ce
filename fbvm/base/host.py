"""What differs by operating system: files and who may write them, signals, waiting for sockets, clocks, memory, libraries of C.

No other module asks on which system it runs.  A function asks `sys.platform` when it is called, so that tests can put a stand-in
for `sys` in its place, and uses the names that only one system has behind that question, so that mypy checks them for each."""

from __future__ import annotations

import errno
import mmap
import os
import re
import signal
import stat
import struct
import sys
import time
import zlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path, PureWindowsPath
from types import FrameType
from typing import IO, TYPE_CHECKING, Any

if TYPE_CHECKING:
    import selectors

# --- files ------------------------------------------------------------------------------------------------------------

WAITLESS = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
"""Flags of `os.open` to read bytes and never wait for another process, as a pipe without a writer would have it."""
REPLACE_TRIES, REPLACE_PAUSE_S = 10, 0.05
"""How often and how long Windows is asked to replace a file that another program has open: a virus scanner lets it go soon."""
_DEVICE = re.compile(r"(?i)(?:con|prn|aux|nul|conin\$|conout\$|(?:com|lpt)[0-9\u00b9\u00b2\u00b3])")
"""Names that are devices under Windows, whatever their ending (learn.microsoft.com, "Naming Files, Paths, and Namespaces")."""
_NOT_IN_NAMES = re.compile(r'[<>:"/\\|?*\x00-\x1f]')
"""Characters that Windows has in no name of a file."""


def replace(part: Path, target: Path) -> None:
    """Puts a file in the place of another one at once.  Raises OSError.

    Windows refuses that while another program has `target` open, and is asked again for half a second."""
    for _ in range(REPLACE_TRIES if sys.platform == "win32" else 0):
        try:
            os.replace(part, target)
        except PermissionError:
            time.sleep(REPLACE_PAUSE_S)
        else:
            return
    os.replace(part, target)


def is_device(name: str) -> bool:
    """True if a file of this name would be a device under Windows.

    >>> is_device("CON"), is_device("aux.st"), is_device("Com1 .txt"), is_device("console.st")
    (True, True, True, False)
    """
    return _DEVICE.fullmatch(name.partition(".")[0].rstrip(" ")) is not None


def portable(name: str) -> str:
    r"""A name of a file that every system takes, made of `name`.

    >>> portable("AUX"), portable("nul.st"), portable("a:b?"), portable("name. ")
    ('AUX_', 'nul_.st', 'a_b_', 'name')
    """
    name = _NOT_IN_NAMES.sub("_", name).rstrip(". ") or "_"
    if not is_device(name):
        return name
    stem, dot, ending = name.partition(".")
    return f"{stem.rstrip(' ')}_{dot}{ending}"


def foreign_path(text: str) -> str:
    r"""What to write instead of a path that another system takes and this one does not; "" for a path that it takes.

    Windows takes / and \ between folders, and has devices; all others take / only, and have no drives."""
    path = PureWindowsPath(text)
    if sys.platform == "win32":
        device = next((part.partition(".")[0] for part in path.parts if is_device(part)), "")
        return f"{device} is a device under Windows, whatever its ending; give the file another name" if device else ""
    if path.drive:
        return f"{path.drive} is a drive of Windows; write a path that begins at the folder of this file"
    return f"write {path.as_posix()}, which every system takes" if "\\" in text else ""


def cache_home() -> Path:
    """The folder for the caches of fbvm where the system wants a user's caches.  It may be missing."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "fbvm" / "cache"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "fbvm"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "fbvm"


def why_untrusted(found: os.stat_result, is_link: bool = False) -> str:
    """Why other users could have written what `os.stat` found, in words that continue "it"; "" if only this user could.

    Of a link, only whose it is counts.  Windows has no such bits: there the folder of a user's own data is closed to others by
    its access list, which is not read."""
    if sys.platform == "win32":
        return ""
    if found.st_uid != os.geteuid():
        return "belongs to another user"
    if not is_link and found.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return "can be written by other users, which chmod go-w ends"
    return ""


# --- signals ----------------------------------------------------------------------------------------------------------

Handle = Callable[[int, FrameType | None], Any]


def _signals(*names: str) -> tuple[signal.Signals, ...]:
    """The signals of these names that the system has."""
    return tuple(number for name in names if (number := getattr(signal, name, None)) is not None)


def ending_signals() -> tuple[signal.Signals, ...]:
    """The signals that ask a program to end, besides Ctrl-C: SIGTERM, SIGHUP (its terminal has gone), Ctrl-Break of Windows."""
    return _signals("SIGTERM", "SIGHUP", "SIGBREAK")


def saving_signals() -> tuple[signal.Signals, ...]:
    """The signals that ask a program to save what it has: SIGUSR1; none under Windows."""
    return _signals("SIGUSR1")


@contextmanager
def handling(numbers: Iterable[signal.Signals], handle: Handle) -> Iterator[None]:
    """Has `handle` called for some signals inside the `with` block.  Does nothing outside the main thread."""
    before: dict[signal.Signals, Any] = {}
    try:
        try:
            for number in numbers:
                before[number] = signal.signal(number, handle)
        except ValueError:  # another thread than the main one
            pass
        yield
    finally:
        for number, call in before.items():
            signal.signal(number, call)


@contextmanager
def interrupt_held() -> Iterator[None]:
    """Lets Ctrl-C wait for the end of the `with` block, which must be short: what begins in it is not left half done.

    Processes that are started in it hear Ctrl-C, unlike those of `signals_held`.  Does nothing outside the main thread."""
    came: list[FrameType | None] = []
    before = signal.getsignal(signal.SIGINT)
    with handling([signal.SIGINT] if callable(before) else [], lambda number, frame: came.append(frame)):
        yield
    if came:
        signal.raise_signal(signal.SIGINT)


@contextmanager
def signals_held() -> Iterator[None]:
    """Lets Ctrl-C and the signals that ask for the end wait until the `with` block is over.

    Processes that are started in it hold them back, too, until they call `let_signals_through`.  Windows holds nothing."""
    if sys.platform == "win32":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, *ending_signals()))
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def let_signals_through() -> None:
    """Ends what `signals_held` has begun in the process that has started this one."""
    if sys.platform != "win32":
        signal.pthread_sigmask(signal.SIG_UNBLOCK, (signal.SIGINT, *ending_signals()))


def interrupt(thread: int) -> None:
    """Does in the main thread, whose number is `thread`, what Ctrl-C does, also while it waits.  Called by another thread."""
    if sys.platform == "win32":
        signal.raise_signal(signal.SIGINT)
    else:
        signal.pthread_kill(thread, signal.SIGINT)


@contextmanager
def deaf_children() -> Iterator[None]:
    """Processes that are started inside the `with` block take no notice of Ctrl-C, which reaches all of a terminal; this one
    takes none meanwhile.  Under Windows nothing changes."""
    if sys.platform == "win32":
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def handle_from_now_on(numbers: Iterable[signal.Signals], handle: Handle) -> None:
    """Has `handle` called for some signals until the process ends."""
    for number in numbers:
        signal.signal(number, handle)


def ignore(numbers: Iterable[signal.Signals]) -> None:
    """Lets some signals have no effect from now on, while the process ends."""
    for number in numbers:
        signal.signal(number, signal.SIG_IGN)


def give_way() -> None:
    """Lets other processes have the processor first, where a process can ask for that: for work that nobody waits for."""
    if sys.platform != "win32":
        os.nice(NICENESS)


NICENESS = 10
"""Beside a process that is busy, one that gives way has a tenth of a processor."""


def can_end_others() -> bool:
    """True if a program can ask another one to end, and not only end it: Windows has no SIGTERM."""
    return sys.platform != "win32"


# --- processes --------------------------------------------------------------------------------------------------------


_HOST = "/proc/sys/kernel/random/boot_id"
"""A file of Linux with a number that no other start of any host has (random(4)); copies of a machine share their machine-id."""


def process_space() -> str:
    """A short name for the processes that know each other by their numbers: under Linux those of this start of the host, in one
    container.  "" under other systems, where nothing tells hosts apart that may use the same folder."""
    try:
        container = os.readlink("/proc/self/ns/pid")
        number = Path(_HOST).read_text(encoding="ascii").strip()
    except (OSError, ValueError):
        return ""
    return f"{zlib.crc32(f'{number} {container}'.encode()):08x}"


def has_ended(process: int) -> bool:
    """True if there is no process of this number; False under Windows, where the same question would end it."""
    if sys.platform != "win32":
        try:
            os.kill(process, 0)
        except (ProcessLookupError, OverflowError):
            return True
        except PermissionError:  # it is another user's
            return False
    return False


# --- files that one process has ---------------------------------------------------------------------------------------

LOCKED_AT = 1 << 62
"""Which byte is locked under Windows: one that nobody reads or writes."""


def taken_alone(file: IO[bytes]) -> bool:
    """Takes an open file for this process alone, until it is closed or the process ends; False if another process has it.

    Others may still read and write it; they only cannot take it."""
    number = file.fileno()
    try:
        if sys.platform == "win32":
            import msvcrt

            at = os.lseek(number, 0, os.SEEK_CUR)
            try:
                os.lseek(number, LOCKED_AT, os.SEEK_SET)
                msvcrt.locking(number, msvcrt.LK_NBLCK, 1)
            finally:
                os.lseek(number, at, os.SEEK_SET)
        else:
            import fcntl

            fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in (errno.EWOULDBLOCK, errno.EACCES, errno.EDEADLK):
            return False
        if error.errno in (errno.ENOTSUP, errno.ENOLCK, errno.ENOSYS):
            return True  # some file systems of networks lock nothing
        raise
    return True


# --- sockets ----------------------------------------------------------------------------------------------------------

FD_SETSIZE = 1024
SIOCOUTQNSD = 0x894B
"""The request of `ioctl` for the bytes that a socket has not sent (linux/sockios.h)."""
TCP_NOTSENT_LOWAT = 25
"""The option of TCP after which a socket can be written to once less than so many bytes are not sent (tcp(7), linux/tcp.h)."""
LONGEST_WAIT_S = 0.25
"""How long Windows may wait for sockets at a time: Ctrl-C does not end its `select`."""


def linger_format() -> str:
    """The form of C's struct `linger`, for `struct`."""
    return "hh" if sys.platform == "win32" else "ii"


def shares_ports() -> bool:
    """True if SO_REUSEADDR says that a port may be listened on again while old connections of it linger.

    Under Windows the option lets several programs listen at once."""
    return sys.platform != "win32"


def keeps_ports() -> bool:
    """True if others can listen beside a socket that is only bound, so that this keeps a port from being given away."""
    return sys.platform == "linux"


def unsent_bytes(number: int) -> int:
    """Bytes that the host has taken for the socket of a file number and not sent yet, since acknowledgements are missing; 0 where
    that is not known."""
    if sys.platform != "linux":
        return 0
    import fcntl

    try:
        size: int = struct.unpack("i", fcntl.ioctl(number, SIOCOUTQNSD, bytes(4)))[0]
    except OSError:  # it has ended
        return 0
    return size


def selector_number(selector: selectors.BaseSelector) -> int | None:
    """The file number of a selector, so that `select` can wait for it; None if it has none, or one that is too high.

    epoll and kqueue have one; the `select` that Windows has does not."""
    fileno: Callable[[], int] | None = getattr(selector, "fileno", None)
    number = fileno() if fileno else -1
    return number if 0 <= number < FD_SETSIZE else None


def select(selector: selectors.BaseSelector, timeout_s: float) -> list[tuple[selectors.SelectorKey, int]]:
    """Waits for the sockets of a selector.  Under Windows it may come back early with none, so that Ctrl-C is heard."""
    if sys.platform != "win32":
        return selector.select(timeout_s)
    if selector.get_map():
        return selector.select(min(timeout_s, LONGEST_WAIT_S))
    time.sleep(timeout_s)  # its `select` raises an error without sockets
    return []


# --- clocks, memory, libraries of C -----------------------------------------------------------------------------------


def monotonic_clock() -> int:
    """The number of the clock of `time.monotonic_ns` for C's clock_gettime; 0 under Windows, which has none."""
    if sys.platform == "win32":
        return 0
    return time.CLOCK_MONOTONIC


def anonymous_memory(size: int) -> mmap.mmap:
    """Zeros, private to this process: to read a page that nobody wrote takes no memory, which it would in shared memory."""
    if sys.platform == "win32":
        return mmap.mmap(-1, size)
    return mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)


def math_library() -> str | None:
    """The library with the functions of C's math.h that Python's `math` calls; None where the process has them itself."""
    return {"linux": "libm.so.6", "win32": "ucrtbase"}.get(sys.platform)


def links_in_place() -> bool:
    """True if LLVM's JITLink can load the system's object files; it does not know all of Windows's COFF."""
    return sys.platform != "win32"


def is_x86_64() -> bool:
    """True for processors of x86-64, which each system calls otherwise."""
    import platform  # slow to load

    return platform.machine() in ("x86_64", "AMD64")
