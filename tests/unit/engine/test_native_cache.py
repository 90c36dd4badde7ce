"""Objects on disk: kept, trusted only when whole and the user's own, thrown away when there are too many."""

from __future__ import annotations

import os
import sys
import threading
from pathlib import Path

import pytest

from fbvm.engine.native import engine as native

if not native.available():
    pytest.skip("llvmlite is not installed", allow_module_level=True)

from fbvm.base import cache
from fbvm.code.compiler import compile_text
from fbvm.engine.native import code as native_code
from fbvm.engine.native.code import Code
from fbvm.engine.native.llvm import cache as native_cache
from fbvm.engine.native.llvm.cache import Stored
from fbvm.engine.native.llvm.compiler import Linked

STORED = Stored({"points": [["R0101", 3, [["i64", None]]]], "context": 512}, b"object" * 100)
NAME = "a" * 64


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("FBVM_CACHE", str(tmp_path))
    return tmp_path / "native"


def test_what_is_written_is_read() -> None:
    assert native_cache.read(NAME) is None
    native_cache.write(NAME, STORED)
    assert native_cache.read(NAME) == STORED


@pytest.mark.parametrize("at", [0, 20, 40, 300, -1])
def test_a_damaged_file_is_passed_over(folder: Path, at: int) -> None:
    native_cache.write(NAME, STORED)
    content = bytearray((folder / NAME).read_bytes())
    content[at] ^= 1
    (folder / NAME).write_bytes(content)
    assert native_cache.read(NAME) is None


@pytest.mark.parametrize("size", [0, 1, 31, 32, 40, 100])
def test_a_file_cut_short_is_passed_over(folder: Path, size: int) -> None:
    native_cache.write(NAME, STORED)
    (folder / NAME).write_bytes((folder / NAME).read_bytes()[:size])
    assert native_cache.read(NAME) is None


@pytest.mark.skipif(sys.platform == "win32", reason="permissions are others there")
def test_a_folder_that_others_can_write_is_not_trusted(folder: Path) -> None:
    native_cache.write(NAME, STORED)
    folder.chmod(0o777)
    assert native_cache.read(NAME) is None
    native_cache.write("b" * 64, STORED)
    assert not (folder / ("b" * 64)).exists()


def test_the_oldest_go_when_there_are_too_many(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = [letter * 64 for letter in "abcdef"]
    for place, name in enumerate(names):
        native_cache.write(name, STORED)
        os.utime(folder / name, (place, place))
    monkeypatch.setattr(native_cache.FILES, "limit_bytes", (folder / names[0]).stat().st_size * 4)
    assert native_cache.read(names[0]) == STORED
    native_cache.write("g" * 64, STORED)
    assert sorted(path.name[0] for path in folder.iterdir()) == ["a", "f", "g"]


def test_small_ones_go_too(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(native_cache.FILES, "limit_files", 8)
    names = [letter * 64 for letter in "abcdefghi"]
    for place, name in enumerate(names):
        native_cache.write(name, STORED)
        os.utime(folder / name, (place, place))
    assert sorted(path.name[0] for path in folder.iterdir()) == ["d", "e", "f", "g", "h", "i"]


def test_the_folder_is_listed_at_the_first_write_and_when_it_may_be_full(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    listed: list[int] = []

    def files(where: Path) -> list[tuple[float, int, str]]:
        found = list(listing(where))
        listed.append(len(found))
        return found

    listing = cache._files
    monkeypatch.setattr(cache, "_files", files)
    monkeypatch.setattr(native_cache.FILES, "limit_files", 8)
    native_cache.write("a" * 64, STORED)
    for number in range(20):  # by another process
        (folder / f"{number:064}").write_bytes(b"other")
    for letter in "bcdefgh":
        native_cache.write(letter * 64, STORED)
    assert listed == [1]
    native_cache.write("i" * 64, STORED)
    assert listed == [1, 29]
    assert len(list(folder.iterdir())) == 6


def test_a_folder_that_cannot_be_made_does_no_harm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("FBVM_CACHE", str(tmp_path / "file"))
    native_cache.write(NAME, STORED)
    assert native_cache.read(NAME) is None


def test_names_depend_on_every_part() -> None:
    names = {native_cache.name_of(*parts) for parts in (("a", "b"), ("ab", ""), ("", "ab"), ("a",), ("b", "a"))}
    assert len(names) == 5


def test_switched_off_nothing_is_read_or_written(folder: Path) -> None:
    native_cache.write(NAME, STORED)
    cache.switch(False)
    try:
        assert native_cache.read(NAME) is None
        native_cache.write("b" * 64, STORED)
    finally:
        cache.switch(True)
    assert not (folder / ("b" * 64)).exists()


@pytest.mark.slow
def test_code_that_comes_a_second_time_moves_nothing() -> None:
    """From the compiler's helper, while it is running already: who runs it, and what it calls, would be gone."""
    compilation = compile_text("PROGRAM Main VAR s : STRING := 'a'; n : INT; END_VAR n := LEN(CONCAT(s, 'b')); END_PROGRAM")
    assert compilation.image
    native_code._part.cache_clear()
    code = Code(compilation.image)
    code.prepare(2)
    before = code.address(0, 2)
    again = code._known(2)
    assert again is not None
    native_code._part.cache_clear()
    code._load(2, again)
    assert code.address(0, 2) == before


@pytest.mark.slow
def test_the_library_is_loaded_once_for_all_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    compilation = compile_text("PROGRAM Main VAR s : STRING := 'a'; n : INT; END_VAR n := LEN(CONCAT(s, 'b')); END_PROGRAM")
    assert compilation.image
    codes = [Code(compilation.image) for _ in range(4)]
    codes[0].prepare(2)
    stored = codes[0]._known(2)
    assert stored is not None
    native_code._part.cache_clear()
    loaded, link = [], Linked

    def counted(compiled: bytes, exports: list[str], others: dict[str, int] | None = None) -> object:
        loaded.append(exports[0])
        return link(compiled, exports, others or {})

    monkeypatch.setattr(native_code, "Linked", counted)
    threads = [threading.Thread(target=code._load, args=(2, stored)) for code in codes[1:]]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert loaded.count("task0") == 3
    assert len(loaded) - 3 == len(stored.facts["parts"])
