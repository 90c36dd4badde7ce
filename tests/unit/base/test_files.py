"""Files that are written: beside and put in place whole, or not at all."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from fbvm.base import host
from fbvm.base.files import check_writable, new_file, write_file


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def inside() -> list[str]:
    return sorted(path.name for path in Path().iterdir())


@pytest.mark.parametrize("ending", [KeyboardInterrupt, OSError, ValueError])
def test_what_is_broken_off_leaves_what_was_there(ending: type[BaseException]) -> None:
    Path("page.html").write_bytes(b"old")
    for name in ("page.html", "new.html"):
        with pytest.raises(ending), new_file(Path(name)) as file:
            file.write(b"half")
            file.flush()
            raise ending
    assert (inside(), Path("page.html").read_bytes()) == (["page.html"], b"old")


KILLED = """
import os, signal
from pathlib import Path
from fbvm.base.files import new_file
with new_file(Path("image.json")) as file:
    file.write(b"half")
    file.flush()
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="others do not tell hosts apart that use the same folder")
def test_what_a_killed_process_has_left_goes_with_the_next_write_in_its_folder() -> None:
    """That of a living process stays, and of another host or container, where the same number is another process."""
    subprocess.run([sys.executable, "-c", KILLED], check=False)
    (left,) = inside()
    others = [left.replace(left.split(".")[2], "01234567"), f".fbvm.{left.split('.')[3]}.part", left.replace("part", "json")]
    living = left.replace(left.split(".")[3], str(os.getppid()))
    for name in (*others, living):
        Path(name).touch()
    write_file(Path("image.json"), "whole")
    assert inside() == sorted([*others, living, "image.json"])


@pytest.mark.skipif(sys.platform == "win32", reason="rights are others there, and links a privilege")
def test_links_and_rights_stay() -> None:
    Path("real").write_bytes(b"old")
    Path("real").chmod(0o640)
    Path("link").symlink_to("real")
    write_file(Path("link"), "new")
    assert (os.readlink("link"), Path("real").read_bytes(), Path("real").stat().st_mode & 0o777) == ("real", b"new", 0o640)
    write_file(Path(os.devnull), "nowhere")
    assert inside() == ["link", "real"]


@pytest.mark.skipif(sys.platform == "win32", reason="links are a privilege there")
def test_links_that_lead_to_one_another_are_an_error_of_the_host() -> None:
    for name, leads in (("one", "other"), ("other", "one"), ("self", "self")):
        Path(name).symlink_to(leads)
    for name in ("one", "self"):
        for wants in (check_writable, lambda path: write_file(path, "text")):
            with pytest.raises(OSError, match=r"(?i)symbolic links"):
                wants(Path(name))
    assert inside() == ["one", "other", "self"]


def test_whether_a_file_can_be_written_is_asked_without_a_trace(monkeypatch: pytest.MonkeyPatch) -> None:
    Path("there").write_bytes(b"old")
    Path("folder").mkdir()
    for good in ("there", "new", os.devnull):
        check_writable(Path(good))
    for wrong in ("folder", "missing/new"):
        with pytest.raises(OSError, match=r"(?i)directory"):
            check_writable(Path(wrong))
    monkeypatch.setattr(os, "access", lambda *_: False)  # the superuser may write all
    with pytest.raises(PermissionError):
        check_writable(Path("there"))
    assert (inside(), Path("there").read_bytes()) == (["folder", "there"], b"old")


def test_windows_is_asked_again_while_a_reader_has_the_file(monkeypatch: pytest.MonkeyPatch) -> None:
    replace, refused, slept = os.replace, [3], [0.0]

    def busy(part: Path, target: Path) -> None:
        if refused[0]:
            refused[0] -= 1
            raise PermissionError(13, "used by another process")
        replace(part, target)

    monkeypatch.setattr(os, "replace", busy)
    monkeypatch.setattr(host, "time", SimpleNamespace(sleep=lambda s: slept.append(s)))
    with pytest.raises(PermissionError):  # elsewhere nobody else can be the reason
        write_file(Path("out"), "text")
    assert (inside(), slept) == ([], [0.0])
    monkeypatch.setattr(host, "sys", SimpleNamespace(platform="win32"))
    refused[0] = 3
    write_file(Path("out"), "text")
    assert (Path("out").read_text(), slept[1:]) == ("text", [host.REPLACE_PAUSE_S] * 3)
    refused[0] = 100
    with pytest.raises(PermissionError, match="used by another"):
        write_file(Path("out"), "other")
    assert (inside(), Path("out").read_text()) == (["out"], "text")
    assert sum(slept) < 1
