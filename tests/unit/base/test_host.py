"""The branches for other systems, with stand-ins: no epoll, no SIGUSR1, drives, devices, files that a reader has open."""

from __future__ import annotations

import errno
import os
import select
import selectors
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner
from rows import each_of

from fbvm import Plc, compile_text
from fbvm.base import host
from fbvm.base.data import cache_folder
from fbvm.cli.main import main
from fbvm.cli.running.serve import Signals
from fbvm.net.tcp import TcpNetwork
from fbvm.record.trace import memory_images
from fbvm.run.project import Project, read_project
from fbvm.testing.pages import file_name


@pytest.fixture
def windows(monkeypatch: pytest.MonkeyPatch) -> None:
    """`fbvm.base.host` as it is under Windows, and the selector that Windows has."""
    monkeypatch.setattr(host, "sys", SimpleNamespace(platform="win32"))
    monkeypatch.setattr(selectors, "DefaultSelector", selectors.SelectSelector)


# --- sockets ----------------------------------------------------------------------------------------------------------

def test_waiting_without_sockets_sleeps(windows: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """The `select` of Windows raises an error when it is given none."""
    slept: list[float] = []
    monkeypatch.setattr(host, "time", SimpleNamespace(sleep=slept.append))
    monkeypatch.setattr(select, "select", None)
    network = TcpNetwork()
    assert network.wait(0.125) is False
    network.close()
    assert slept == [0.125]


def test_waiting_comes_back_in_time_for_ctrl_c(windows: None) -> None:
    asked: list[float | None] = []

    class Watched(selectors.SelectSelector):
        def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
            asked.append(timeout)
            return []

    with Watched() as selector, socket.socket() as sock:
        selector.register(sock, selectors.EVENT_READ)
        assert host.select(selector, 3600.0) == []
        assert host.select(selector, 0.01) == []
    assert asked == [host.LONGEST_WAIT_S, 0.01]
    assert host.LONGEST_WAIT_S < 1


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["SelectSelector", "PollSelector", "DefaultSelector"])
def test_an_exchange_with_every_selector(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if not hasattr(selectors, kind):
        pytest.skip("the system has none")
    monkeypatch.setattr(selectors, "DefaultSelector", getattr(selectors, kind))
    if kind == "SelectSelector":
        monkeypatch.setattr(host, "sys", SimpleNamespace(platform="win32"))
    program = Path(__file__).parents[3] / "examples" / "demo.st"
    ends = "Main.Error_Code <> 0 OR Main.Connection.Error_Code <> 0"
    result = CliRunner().invoke(main, ["run", str(program), "--map", "192.168.250.1:502=127.0.0.1:1", "--net", "tcp",
                                       "--pace", "event", "--until", ends, "--max", "20s"])  # fmt: skip
    assert result.exit_code == 0, result.output  # nobody listens on port 1: the program is told so


def test_what_sockets_are_told(windows: None) -> None:
    assert (host.linger_format(), host.shares_ports(), host.keeps_ports(), host.can_end_others()) == ("hh", False, False, False)
    with selectors.SelectSelector() as selector:
        assert host.selector_number(selector) is None


# --- signals ----------------------------------------------------------------------------------------------------------


def test_signals_that_a_system_lacks(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("SIGUSR1", "SIGHUP"):
        monkeypatch.delattr(signal, name, raising=False)
    monkeypatch.setattr(signal, "SIGBREAK", signal.SIGABRT, raising=False)
    assert (host.saving_signals(), host.ending_signals()) == ((), (signal.SIGTERM, signal.SIGABRT))
    signals = Signals()
    with signals.installed():
        signal.raise_signal(signal.SIGABRT)
    assert (signals.end, signals.save) == (True, False)
    assert signal.getsignal(signal.SIGABRT) is signal.SIG_DFL


@pytest.mark.parametrize("system", [sys.platform, "win32"])
def test_another_thread_interrupts_the_main_one(system: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(host, "sys", SimpleNamespace(platform=system))
    asking = threading.Thread(target=host.interrupt, args=[threading.get_ident()])
    with pytest.raises(KeyboardInterrupt):
        asking.start()
        asking.join(5)
        time.sleep(5)


def test_work_that_nobody_waits_for_gives_way(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []
    monkeypatch.setattr("os.nice", asked.append, raising=False)
    for system in ("linux", "darwin", "win32"):
        monkeypatch.setattr(host, "sys", SimpleNamespace(platform=system))
        host.give_way()
    assert asked == [10, 10]


def test_ctrl_c_waits_for_the_end_of_what_holds_it(monkeypatch: pytest.MonkeyPatch) -> None:
    done = []
    with pytest.raises(KeyboardInterrupt), host.interrupt_held():
        signal.raise_signal(signal.SIGINT)
        done.append(1)
    assert done == [1] and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    with host.interrupt_held():
        done.append(2)
    with pytest.raises(KeyboardInterrupt), host.signals_held():
        signal.raise_signal(signal.SIGINT)
        done.append(3)
    monkeypatch.setattr(host, "sys", SimpleNamespace(platform="win32"))  # where nothing holds it back
    with pytest.raises(KeyboardInterrupt), host.signals_held():
        signal.raise_signal(signal.SIGINT)
        done.append(4)
    with host.deaf_children():
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    monkeypatch.undo()
    with host.deaf_children():
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    assert done == [1, 2, 3] and signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.skipif(sys.platform == "win32", reason="there another call locks")
def test_a_file_that_one_process_has(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "taken"
    path.write_bytes(b"kept")
    with open(path, "rb+") as first, open(path, "rb+") as second:
        assert host.taken_alone(first) and not host.taken_alone(second)
        assert second.read() == b"kept"
    with open(path, "rb+") as again:
        assert host.taken_alone(again)
        for number, expected in ((errno.EACCES, False), (errno.EDEADLK, False), (errno.ENOLCK, True), (errno.ENOTSUP, True)):
            monkeypatch.setattr("fcntl.flock", _refusing(number))
            assert host.taken_alone(again) is expected, number
        monkeypatch.setattr("fcntl.flock", _refusing(errno.EIO))
        with pytest.raises(OSError):
            host.taken_alone(again)


def test_processes_that_have_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    """One of another user lives; under Windows the question would end it."""
    with subprocess.Popen([sys.executable, "-c", ""]) as process:
        process.wait()
    assert host.has_ended(process.pid) is (sys.platform != "win32")
    assert not host.has_ended(os.getpid())
    monkeypatch.setattr(os, "kill", _refusing(errno.EPERM))
    assert not host.has_ended(process.pid)
    monkeypatch.setattr(host, "sys", SimpleNamespace(platform="win32"))
    monkeypatch.setattr(os, "kill", lambda *_: pytest.fail("asked"))
    assert not host.has_ended(process.pid)


def test_hosts_and_containers_have_processes_of_their_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    started = tmp_path / "boot_id"
    monkeypatch.setattr(host, "_HOST", str(started))
    containers = {"/proc/self/ns/pid": "pid:[1]"}
    monkeypatch.setattr(os, "readlink", containers.__getitem__)
    assert host.process_space() == ""
    seen = set()
    for text in ("a", "b"):
        started.write_text(f"{text}\n", encoding="ascii")
        seen.add(host.process_space())
    containers["/proc/self/ns/pid"] = "pid:[2]"
    assert len({*seen, host.process_space()}) == 3 and all(len(space) == 8 for space in seen)
    monkeypatch.setattr(os, "readlink", _refusing(errno.ENOENT))
    assert host.process_space() == ""


def _refusing(number: int) -> Callable[..., None]:
    def refuse(*_: object) -> None:
        raise OSError(number, os.strerror(number))

    return refuse


# --- files ------------------------------------------------------------------------------------------------------------


@each_of(("name", "portable"), [
    ("CON", "CON_"), ("aux.st", "aux_.st"), ("Nul.tar.gz", "Nul_.tar.gz"), ("com7", "com7_"), ("LPT¹.txt", "LPT¹_.txt"),
    ("conin$", "conin$_"), ("PRN .st", "PRN_.st"), ("console", "console"), ("com10", "com10"), ("a:b", "a_b"), ("what?", "what_"),
    ("end.", "end"), ("...", "_"), ("tab\t", "tab_"),
])
def test_names_of_files(name: str, portable: str) -> None:
    assert host.portable(name) == portable
    assert host.portable(portable) == portable
    assert not host.is_device(portable)


DOCUMENT = """<?xml version="1.0" encoding="utf-8"?>
<project xmlns="http://www.plcopen.org/xml/tc6_0201">
<fileHeader companyName="" productName="" productVersion="" creationDateTime="2020-01-01T00:00:00"/>
<contentHeader name="x"><coordinateInfo><fbd><scaling x="1" y="1"/></fbd><ld><scaling x="1" y="1"/></ld>
<sfc><scaling x="1" y="1"/></sfc></coordinateInfo></contentHeader>
<types><dataTypes/><pous>{}</pous></types><instances><configurations/></instances></project>"""
POU = """<pou name="{}" pouType="program"><interface/><body><ST>
<xhtml xmlns="http://www.w3.org/1999/xhtml">;</xhtml></ST></body></pou>"""


def test_what_fbvm_writes_is_no_device(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names = ["CON", "aux", "NUL", "com1", "Lpt9", "prn"]
    Path("in.xml").write_text(DOCUMENT.format("".join(map(POU.format, names))), encoding="utf-8")
    result = CliRunner().invoke(main, ["import", "in.xml", "-o", "out"], catch_exceptions=False)
    assert sorted(path.name for path in Path("out").iterdir()) == sorted(f"{name}_.st" for name in names), result.output
    assert not [test for test in ("aux.py::test_a", "con/test_b.py::test_c", "nul") if host.is_device(file_name(test))]
    for name in ("con", "aux.1", "name."):
        result = CliRunner().invoke(main, ["new", name])
        assert (result.exit_code, Path(name).exists()) == (2, False)
        assert "Windows" in result.output


def read(folder: Path, sources: str, libraries: str = "") -> Any:
    (folder / "fbvm.toml").write_text(f"[plc.a]\nsources = [{sources}]\n{libraries}", encoding="utf-8")
    return read_project(folder / "fbvm.toml")


@each_of(("sources", "libraries", "path", "hint"), [
    (r"'src\main.st'", "", r"sources: src\main.st", "write src/main.st, which every system takes"),
    (r"'a.st', 'C:\plant\main.st'", "", r"sources: C:\plant\main.st", "C: is a drive of Windows; write a path that begins at"),
    ("'D:main.st'", "", "sources: D:main.st", "D: is a drive of Windows"),
    (r"'\\server\share\a.st'", "", r"sources: \\server\share\a.st", r"\\server\share is a drive of Windows"),
    ("'a.st'", r"libraries = ['..\lib']", r"libraries: ..\lib", "write ../lib, which every system takes"),
])
def test_paths_of_windows_elsewhere(tmp_path: Path, sources: str, libraries: str, path: str, hint: str) -> None:
    (found,) = read(tmp_path, sources, libraries)
    assert (found.code, found.message) == ("P0103", f"plc.a.{path} is no path on this system")
    assert found.hint.startswith(hint)


@pytest.mark.skipif(os.sep == "\\", reason="there it is a path")
def test_a_file_with_a_backslash_in_its_name_is_one(tmp_path: Path) -> None:
    (tmp_path / r"src\main.st").write_text("")
    assert isinstance(read(tmp_path, r"'src\main.st'"), Project)


def test_paths_under_windows(windows: None, tmp_path: Path) -> None:
    assert isinstance(read(tmp_path, r"'src\main.st', 'C:\plant\main.st', 'a/b.st'"), Project)
    (found,) = read(tmp_path, "'src/aux.st'")
    assert found.hint == "aux is a device under Windows, whatever its ending; give the file another name"


def test_an_image_that_a_reader_has_open(windows: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(13, "The process cannot access the file because it is being used by another process")

    monkeypatch.setattr(host, "time", SimpleNamespace(sleep=lambda s: None))
    monkeypatch.setattr(os, "replace", refuse)
    image = compile_text("PROGRAM Main END_PROGRAM").image
    assert image is not None
    plc = Plc(image)
    with pytest.raises(PermissionError, match="used by another"):
        memory_images.save(plc.memory, tmp_path / "image.json", {"D": 10})
    assert list(tmp_path.iterdir()) == []


# --- folders, memory, libraries ---------------------------------------------------------------------------------------


def test_folders_of_caches(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Path, "home", lambda: Path("/home/u"))
    for name in ("LOCALAPPDATA", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    found = {}
    for system in ("linux", "darwin", "win32", "freebsd14"):
        monkeypatch.setattr(host, "sys", SimpleNamespace(platform=system))
        found[system] = host.cache_home().as_posix()
    assert found == {"linux": "/home/u/.cache/fbvm", "darwin": "/home/u/Library/Caches/fbvm",
                     "win32": "/home/u/AppData/Local/fbvm/cache", "freebsd14": "/home/u/.cache/fbvm"}  # fmt: skip
    monkeypatch.setattr(host, "sys", SimpleNamespace(platform="win32"))
    monkeypatch.setenv("LOCALAPPDATA", "/data")
    assert host.cache_home().as_posix() == "/data/fbvm/cache"
    monkeypatch.setenv("FBVM_CACHE", "/elsewhere")
    assert cache_folder().as_posix() == "/elsewhere"
    for unset in (lambda: monkeypatch.setenv("FBVM_CACHE", ""), lambda: monkeypatch.delenv("FBVM_CACHE")):
        unset()
        assert cache_folder().as_posix() == "/data/fbvm/cache"


def test_memory_without_private_mappings(windows: None, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[dict[str, object]] = []
    monkeypatch.setattr(host.mmap, "mmap", lambda number, size, **options: made.append(options) or bytearray(size))
    host.anonymous_memory(4096)
    assert made == [{}]
    assert host.monotonic_clock() == 0


def test_libraries(windows: None, monkeypatch: pytest.MonkeyPatch) -> None:
    assert (host.math_library(), host.links_in_place()) == ("ucrtbase", False)
    monkeypatch.setattr(host, "sys", SimpleNamespace(platform="darwin"))
    assert (host.math_library(), host.links_in_place()) == (None, True)


def test_under_windows_a_byte_is_locked_that_nobody_reads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And the place in the file is afterwards what it was, also if another process has it."""
    asked: list[tuple[int, int, int]] = []

    def locking(number: int, how: int, count: int) -> None:
        asked.append((os.lseek(number, 0, os.SEEK_CUR), how, count))
        if len(asked) > 1:
            raise PermissionError(errno.EACCES, "another process has it")

    monkeypatch.setitem(sys.modules, "msvcrt", SimpleNamespace(LK_NBLCK=5, locking=locking))
    monkeypatch.setattr(host, "LOCKED_AT", 1000)  # where the real place is, files of this host may not reach
    with (tmp_path / "file").open("w+b", buffering=0) as file:
        file.write(b"abcdef")
        file.seek(3)
        monkeypatch.setattr(sys, "platform", "win32")
        taken = [host.taken_alone(file), host.taken_alone(file)]
        place = os.lseek(file.fileno(), 0, os.SEEK_CUR)
        monkeypatch.undo()
    assert taken == [True, False] and place == 3
    assert asked == [(1000, 5, 1)] * 2
