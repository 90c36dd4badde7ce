"""Files of the cache are executed: only those are read that nobody but the user could have written, and the rest is named."""

from __future__ import annotations

import os
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

from fbvm.base import cache, host
from fbvm.base.cache import Cache, make_folder
from fbvm.cli.main import main

NAME = "a" * 64
KEPT = Cache("kept", b"kept 1\n", 1 << 20)
posix = pytest.mark.skipif(sys.platform == "win32", reason="there access lists say who may write, not bits")


@pytest.fixture
def root(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the caches, with one file in it."""
    root = tmp_path / "caches"
    monkeypatch.setenv("FBVM_CACHE", str(root))
    KEPT.write(NAME, b"content")
    assert KEPT.read(NAME) == b"content"
    return root


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The warnings."""
    said: list[str] = []
    monkeypatch.setattr(cache, "_warn", said.append)
    monkeypatch.setattr(cache, "_warned", set())
    return said


def refused(said: list[str], path: Path, why: str) -> None:
    """Nothing is read, nothing is written, and one sentence says why, however often somebody asks."""
    for _ in range(3):
        assert KEPT.read(NAME) is None
    assert said == [f"{path} in the cache is not used: it {why}"]


WRITABLE = "can be written by other users, which chmod go-w ends"
FOREIGN = "belongs to another user"


@posix
@pytest.mark.parametrize("mode", [0o770, 0o707, 0o777, 0o1777])
@pytest.mark.parametrize("inner", ["", "kept"])
def test_a_folder_that_others_can_write(root: Path, said: list[str], mode: int, inner: str) -> None:
    (root / inner).chmod(mode)
    refused(said, root / inner, WRITABLE)
    KEPT.write("b" * 64, b"more")
    assert not (root / "kept" / ("b" * 64)).exists()


@posix
@pytest.mark.parametrize("mode", [0o620, 0o602, 0o666])
def test_a_file_that_others_can_write(root: Path, said: list[str], mode: int) -> None:
    (root / "kept" / NAME).chmod(mode)
    refused(said, root / "kept" / NAME, WRITABLE)
    KEPT.write(NAME, b"again")  # a new file takes its place
    assert KEPT.read(NAME) == b"again"


@posix
def test_a_folder_of_another_user(root: Path, said: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: root.stat().st_uid + 1)
    refused(said, root, FOREIGN)


@posix
def test_a_file_of_another_user(root: Path, said: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    known = os.fstat

    def foreign(number: int) -> os.stat_result:
        found = known(number)
        return os.stat_result((*found[:4], os.geteuid() + 1, *found[5:10]))

    monkeypatch.setattr(os, "fstat", foreign)
    refused(said, root / "kept" / NAME, FOREIGN)


@posix
def test_a_link_to_a_folder_counts_like_its_target(root: Path, said: list[str]) -> None:
    there = root.rename(root.with_name("elsewhere"))
    root.symlink_to(there)
    assert KEPT.read(NAME) == b"content"
    (there / "kept").chmod(0o777)
    refused(said, root / "kept", WRITABLE)


@posix
def test_a_link_of_another_user(root: Path, said: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    root.symlink_to(root.rename(root.with_name("elsewhere")))
    of_link = SimpleNamespace(st_uid=os.geteuid() + 1, st_mode=0o120777)
    monkeypatch.setattr(Path, "lstat", lambda path: of_link)
    monkeypatch.setattr(Path, "is_symlink", lambda path: path == root)
    refused(said, root, FOREIGN)


@posix
def test_folders_are_made_for_the_user_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FBVM_CACHE", str(tmp_path / "home" / "caches"))
    before = os.umask(0)
    try:
        KEPT.write(NAME, b"content")
    finally:
        os.umask(before)
    made = [tmp_path / "home" / "caches", tmp_path / "home" / "caches" / "kept"]
    assert [path.stat().st_mode & 0o777 for path in made] == [0o700, 0o700]
    assert (made[1] / NAME).stat().st_mode & 0o777 == 0o600
    assert make_folder() == made[0]


def test_what_cannot_be_put_in_place_is_removed(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(13, "a reader has the file open")

    monkeypatch.setattr(os, "replace", refuse)
    KEPT.write("b" * 64, b"more")
    assert [path.name for path in (root / "kept").iterdir()] == [NAME]


def test_windows_asks_no_owner(root: Path, said: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(host, "sys", SimpleNamespace(platform="win32"))
    monkeypatch.delattr(os, "geteuid", raising=False)
    assert KEPT.read(NAME) == b"content"
    KEPT.write(NAME, b"again")
    assert (KEPT.read(NAME), said) == (b"again", [])


@posix
def test_a_verb_says_it_once_and_compiles(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "main.st"
    program.write_text("PROGRAM Main VAR a : INT; END_VAR a := 1; END_PROGRAM\n")
    monkeypatch.setenv("FBVM_CACHE", str(tmp_path / "caches"))
    run = ["run", str(program), "--scans", "1", "--show", "Main.a"]
    assert CliRunner().invoke(main, run).stderr == ""
    (tmp_path / "caches").chmod(0o777)
    monkeypatch.setattr(cache, "_warned", set())
    result = CliRunner().invoke(main, run, catch_exceptions=False)
    assert (result.exit_code, result.stdout) == (0, "Main.a = 1\n")
    assert result.stderr == f"{tmp_path / 'caches'} in the cache is not used: it {WRITABLE}\n"


def test_the_state_of_a_folder_is_that_of_all_files_below(tmp_path: Path) -> None:
    (tmp_path / "inner" / "deep").mkdir(parents=True)
    (tmp_path / "inner" / "deep" / "TON.st").write_text("old")
    (tmp_path / "__pycache__").mkdir()
    before = list(cache._state(str(tmp_path)))
    (tmp_path / "__pycache__" / "made.py").write_text("not looked at")
    (tmp_path / "notes.md").write_text("nothing that is compiled")
    assert list(cache._state(str(tmp_path))) == before != []
    (tmp_path / "inner" / "deep" / "TON.st").write_text("newer")
    assert list(cache._state(str(tmp_path))) != before


def written(root: Path, kept: Cache, count: int, processes: bool) -> list[int]:
    """Writes so many files of 100 bytes, each used a second later than the one before; returns which of them are there.

    Each `process` lists the folder at its first write, so that all files count."""
    for number in range(count):
        kept = replace(kept, _held={}) if processes else kept
        kept.write(str(number), bytes(100 - len(kept.head) - 32))
        if (kept.folder / str(number)).exists():
            os.utime(kept.folder / str(number), (number, number))
    return sorted(int(path.name) for path in kept.folder.iterdir())


@pytest.mark.parametrize("processes", [False, True], ids=["one process", "several processes"])
@pytest.mark.parametrize("limits", [(1000, 99), (1 << 20, 10)], ids=["bytes", "files"])
def test_above_a_limit_the_oldest_files_go_until_a_quarter_is_free(root: Path, limits: tuple[int, int], processes: bool) -> None:
    assert written(root, Cache("full", b"head", *limits), 10, processes) == list(range(10))
    assert written(root, Cache("more", b"head", *limits), 11, processes) == list(range(4, 11))
    assert written(root, Cache("most", b"head", *limits), 14, processes) == list(range(4, 14))
