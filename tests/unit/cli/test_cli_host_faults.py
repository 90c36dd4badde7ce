"""A full disk, a reader that has gone, an encoding without boxes: a sentence, the exit status, and files that are good so far."""

from __future__ import annotations

import errno
import io
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result
from rows import each_of, first_quick

from fbvm.base.areas import AREAS, SLOTS_OFFSET
from fbvm.base.memory import Memory
from fbvm.cli.main import main
from fbvm.cli.programs import fmt
from fbvm.cli.running import step
from fbvm.cli.shared import files, run_recording, streams
from fbvm.cli.shared.files import OutputError, growing_file
from fbvm.cli.shared.streams import ASCII, prepare_streams
from fbvm.record.trace import memory_images

EXAMPLES = Path(__file__).parents[3] / "examples"
DEMO = str(EXAMPLES / "demo.st")
PEER = ["--map", "192.168.250.1:502=peer"]
FBVM = [sys.executable, "-m", "fbvm"]
on_posix = pytest.mark.skipif(not os.path.exists("/dev/full"), reason="the system has no /dev/full")


class SmallDisk(io.FileIO):
    """A file on a disk that is full after some bytes."""

    room_bytes = 0

    def write(self, data: Any, /) -> int:
        """Writes as much as there is room for."""
        fitting = bytes(data)[: self.room_bytes - self.tell()]
        if not fitting:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return super().write(fitting) or 0


@pytest.fixture
def disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[int], None]:
    """Sets the bytes that there is room for in each file that grows."""
    monkeypatch.chdir(tmp_path)

    def small(room_bytes: int) -> None:
        monkeypatch.setattr(SmallDisk, "room_bytes", room_bytes)
        monkeypatch.setattr(files, "open", lambda path, mode, buffering: SmallDisk(path, mode), raising=False)

    return small


def fbvm(*arguments: str) -> Result:
    return CliRunner().invoke(main, arguments, catch_exceptions=False)


VARIES = 64
"""Bytes by which the file of a run may be shorter than that of another one: it holds when it began, and is compressed."""


@pytest.mark.slow
@pytest.mark.parametrize("option", ["--trace", "--journal", "--pcap"])
def test_a_disk_that_is_full_during_a_run(disk: Callable[[int], None], option: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run_recording, "FLUSHES", sys.maxsize)  # on a busy machine a run of a second would have more blocks
    # In machine code fewer keyframes are needed; when that of an "auto" run is ready depends on how busy the machine is, and
    # on whether its compiler lives: under a limit of processor time the helper process dies, and the run goes on in Python.
    run = ["run", DEMO, *PEER, "--scans", "900", "--engine", "python", option, "out.file"]
    assert fbvm(*run).exit_code == 0
    whole = Path("out.file").read_bytes()
    for room_bytes in (0, 5, len(whole) // 2, len(whole) - VARIES):
        disk(room_bytes)
        result = fbvm(*run)
        assert result.exit_code == 4
        assert result.stderr == "out.file cannot be written any further: no space left on device\n"
        assert Path("out.file").stat().st_size <= room_bytes
    if option == "--trace":
        assert fbvm("chart", "out.file", "Main.Step", "--scans", "0..50").exit_code == 0
    if option == "--journal":
        disk(len(whole) - VARIES)
        assert fbvm(*run).exit_code == 4
        result = fbvm("replay", "out.file")
        assert result.exit_code == 0
        assert "cut off" in result.stderr


def test_nothing_is_written_behind_a_gap(disk: Callable[[int], None]) -> None:
    disk(4)
    with pytest.raises(OutputError), growing_file("grown") as file:
        file.write(b"123456")
        file.flush()
    assert Path("grown").read_bytes() == b"1234"


@on_posix
@pytest.mark.slow
@each_of(("arguments", "status"), [
    (("list", DEMO), 2), (("explain",), 2), (("--help",), 2), (("run", DEMO, "--scans", "2", "--show", "D0", "--json"), 2),
    (("run", DEMO, "--scans", "2", "--html", "/dev/full"), 2), (("convert", "run.fbtrace", "/dev/full"), 2),
])
def test_an_output_that_is_full(tmp_path: Path, arguments: tuple[str, ...], status: int) -> None:
    with open("/dev/full", "wb") as full:
        done = subprocess.run([*FBVM, *arguments], stdout=full, stderr=subprocess.PIPE, text=True, cwd=tmp_path, timeout=60)
    assert done.returncode == status
    assert "Traceback" not in done.stderr
    assert "written" in done.stderr or "does not exist" in done.stderr


@on_posix
@pytest.mark.slow
def test_a_reader_that_has_gone(tmp_path: Path) -> None:
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run([*FBVM, "explain"], stdout=write, stderr=subprocess.PIPE, text=True, cwd=tmp_path, timeout=60)
    os.close(write)
    assert (done.returncode, done.stderr) == (141, "")


@on_posix
@pytest.mark.slow
def test_streams_that_are_closed(tmp_path: Path) -> None:
    for closed in ("<&-", ">&-", "2>&-", "<&- >&- 2>&-"):
        done = subprocess.run(f'"{sys.executable}" -m fbvm list "{DEMO}" {closed}', shell=True, capture_output=True, cwd=tmp_path,
                              timeout=60)  # fmt: skip
        assert done.returncode == 0
        assert b"Traceback" not in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize(("encoding", "verb"), first_quick([
    ("cp1252", ("ladder", "ladder.st")), ("ascii", ("ladder", "ladder.st")), ("ascii", ("sfc", "sfc.st")),
    ("cp437", ("sfc", "sfc.st")), ("cp850", ("ladder", "ladder.st")), ("cp850", ("sfc", "sfc.st")), ("cp1252", ("sfc", "sfc.st")),
]))
def test_drawings_in_an_encoding_without_boxes(encoding: str, verb: tuple[str, str]) -> None:
    arguments = [verb[0], str(EXAMPLES / verb[1])]
    expected = CliRunner().invoke(main, arguments).output
    found = CliRunner(charset=encoding).invoke(main, arguments, catch_exceptions=False)
    assert found.exit_code == 0
    assert "?" not in found.output.replace("RUNG", "")
    assert list(map(len, found.output.splitlines())) == list(map(len, expected.splitlines()))
    if encoding == "ascii":
        assert found.output == "".join(ASCII.get(character, character) for character in expected)


@each_of(("encoding", "shown"), [
    ("cp850", 'say "hello" - it\'s 5 - µm ×'), ("cp1252", "say “hello” – it’s 5 - µm ×"),
    ("ascii", 'say "hello" - it\'s 5 - um x'),
])
def test_messages_in_code_pages_of_windows(tmp_path: Path, encoding: str, shown: str) -> None:
    (tmp_path / "line.st").write_text("PROGRAM Main x := ; // say “hello” – it’s 5 − µm ×\nEND_PROGRAM\n", encoding="utf-8")
    found = CliRunner(charset=encoding).invoke(main, ["check", str(tmp_path / "line.st")], catch_exceptions=False)
    assert found.exit_code == 3
    assert f"// {shown}" in found.output


@on_posix
@pytest.mark.slow
@each_of("closed", [">&-", "2>&-", "<&- >&- 2>&-"])
def test_processes_of_a_verb_have_streams_where_its_own_are_closed(tmp_path: Path, closed: str) -> None:
    (tmp_path / "test_counts.py").write_text("def test_counts():\n    assert 1 + 1 == 2\n")
    done = subprocess.run(f'"{sys.executable}" -m fbvm test test_counts.py {closed}', shell=True, capture_output=True,
                          cwd=tmp_path, timeout=60)  # fmt: skip
    assert (done.returncode, b"Traceback" in done.stdout + done.stderr) == (0, False)


def test_an_input_without_an_end_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(step, "SCRIPT_LINE_CHARACTERS", 20)
    monkeypatch.setattr(fmt, "SOURCE_BYTES", 1 << 20)
    done = CliRunner().invoke(main, ["step", DEMO], input="help\n" + 21 * "x")
    assert (done.exit_code, done.stderr.splitlines()[-1]) == (
        2, "Error: a line of the standard input has more than 20 characters")
    done = CliRunner().invoke(main, ["fmt", "-"], input=(1 << 20) * b"x" + b"x")
    assert (done.exit_code, done.stderr.splitlines()[0]) == (
        3, "stdin:1:1: error S0107: stdin cannot be read: it has more than 1 MiB")


@on_posix
@pytest.mark.slow
def test_an_input_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    for words, status, said in ((("step", DEMO), 2, "the standard input cannot be read: "),
                                (("fmt", "-"), 3, "stdin cannot be read: ")):  # fmt: skip
        with (tmp_path / "input").open("wb") as only_written:
            done = subprocess.run([*FBVM, *words], stdin=only_written, capture_output=True, text=True, timeout=60)
        assert (done.returncode, said in done.stderr, "Traceback" in done.stderr) == (status, True, False)


def test_a_script_that_its_encoding_cannot_read_is_shown_with_its_bytes() -> None:
    done = CliRunner(charset="ascii").invoke(main, ["step", DEMO], input=b"print \xff\n")
    assert (done.exit_code, done.stdout.splitlines()[-1]) == (2, "> print \\xff")


@each_of(("error", "lacking"), [
    (MemoryError(), "memory"), (RuntimeError("can't start new thread"), "threads"),
    (OSError(errno.EMFILE, "Too many open files"), "open files"),
    (OSError(errno.EAGAIN, "Resource temporarily unavailable"), "processes"),
])
def test_what_the_system_does_not_give_is_said(error: Exception, lacking: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object) -> None:
        raise error

    monkeypatch.setattr(fmt, "_read", refused)
    done = fbvm("fmt", DEMO)
    assert (done.exit_code, done.stderr) == (2, f"the system gives fbvm no more {lacking} (`ulimit -a` shows its limits)\n")


@each_of(("error", "said"), [
    (FileNotFoundError(errno.ENOENT, "No such file or directory"), "the folder in which fbvm was started has gone"),
    (OSError(errno.ENOSPC, "No space left on device", "m.st", None, "copy/m.st"),
     "copy/m.st cannot be used: no space left on device"),
    (OSError("python ended with status 1 before it began"), "python ended with status 1 before it began"),
])
def test_what_the_host_refuses_is_said_by_its_place(error: OSError, said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object) -> None:
        raise error

    monkeypatch.setattr(fmt, "_read", refused)
    monkeypatch.setattr("fbvm.cli.main.give_up_output", lambda: None)
    done = fbvm("fmt", DEMO)
    assert (done.exit_code, done.stderr) == (2, f"{said}\n")


@each_of("verb", ["peer", "lsp", "test"])
def test_what_would_lack_open_files_is_not_begun(verb: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """An event loop prints a traceback when it is thrown away half made, and so does pytest."""
    before = os.pipe()
    given = [before]

    def pipe() -> tuple[int, int]:
        if not given:
            raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))
        return given.pop()

    with monkeypatch.context() as patch:
        patch.setattr(os, "pipe", pipe)
        done = fbvm(verb)
    assert (done.exit_code, done.stderr) == (2, "the system gives fbvm no more open files (`ulimit -a` shows its limits)\n")
    for number in before:
        with pytest.raises(OSError, match="Bad file descriptor"):
            os.close(number)


def test_an_output_is_given_up_also_where_no_more_files_can_be_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object, **__: object) -> None:
        raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))

    monkeypatch.setattr(sys, "stdout", sys.stdout)
    monkeypatch.setattr(os, "open", refused)
    monkeypatch.setattr(streams, "open", refused, raising=False)
    streams.give_up_output()
    print("nowhere")


def test_closed_streams_are_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("stdin", "stdout", "stderr"):
        monkeypatch.setattr(sys, name, None)
    prepare_streams()
    print("nowhere")
    assert sys.stdin.read() == ""
    for stream in (sys.stdin, sys.stdout, sys.stderr):
        stream.close()


@pytest.mark.slow
@each_of("option", [
    ("run", "--scans", "3", "--html"), ("prove", "--never", "Main.n > 3", "--trace"), ("prove", "--tests"),
    ("prove", "--never", "Main.n > 3", "--html"), ("prove", "--never", "Main.n > 3", "--test"),
    ("sweep", "--for", "1s", "--vary", "Main.n=1", "--csv"), ("campaign", "--for", "1s", "--runs", "2", "--csv"),
])  # fmt: skip
def test_an_output_that_cannot_be_written_is_refused_before_the_work(
    option: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    def works(*_: object, **__: object) -> None:
        raise AssertionError("the work has begun")

    for place in ("fbvm.run.loop.run_all", "fbvm.campaign.runs.conduct", "fbvm.cli.programs.prove.proved_once",
                  "fbvm.cli.programs.prove_tests.cover"):  # fmt: skip
        monkeypatch.setattr(place, works)
    monkeypatch.chdir(tmp_path)
    Path("count.st").write_text("PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM")
    result = fbvm(option[0], "count.st", *option[1:], "nope/out")
    assert (result.exit_code, result.stderr.splitlines()[-1]) == (
        2, "Error: nope/out cannot be written: no such file or directory")


# --- memory images ----------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_serve_refuses_an_image_that_cannot_be_written(tmp_path: Path) -> None:
    missing = str(tmp_path / "nope" / "image")
    result = fbvm("serve", "--port", "0", "--image", missing)
    assert result.exit_code == 2
    assert f"{missing} cannot be written" in result.output


@pytest.mark.skipif(sys.platform == "win32", reason="rights are others there, and links a privilege")
def test_an_image_goes_where_its_link_leads_and_overwrites_nothing_else(tmp_path: Path) -> None:
    memory, real, link = Memory(SLOTS_OFFSET, AREAS), tmp_path / "real", tmp_path / "image"
    real.write_bytes(b"old")
    real.chmod(0o640)
    link.symlink_to("real")
    (tmp_path / "image.new").write_bytes(b"of the user")
    memory_images.save(memory, link, {"D": 10})
    assert (os.readlink(link), real.read_bytes()[:10], real.stat().st_mode & 0o777) == ("real", b'{"spaces":', 0o640)
    assert (tmp_path / "image.new").read_bytes() == b"of the user"


def test_an_image_is_replaced_at_once_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    memory, path = Memory(SLOTS_OFFSET, AREAS), tmp_path / "image.json"
    memory.words("D")[0] = 7
    memory_images.save(memory, path, {"D": 10})
    before = path.read_bytes()
    memory.words("D")[0] = 8

    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", full)
        with pytest.raises(OSError, match="No space"):
            memory_images.save(memory, path, {"D": 10})
    assert [entry.name for entry in tmp_path.iterdir()] == ["image.json"]
    assert path.read_bytes() == before


