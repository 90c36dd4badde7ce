"""Small parts that everything stands on: strings by characters, memory, caches, signals, files, folders, short numbers."""

from __future__ import annotations

import math
import os
import signal
import socket
import struct
import sys
import threading
from pathlib import Path
from typing import Any

import pytest
from rows import each_of

from fbvm.base import arithmetic, cache, data, files, host, strings
from fbvm.base.areas import AREAS, E_PLC_ADDRESS, E_WORDS, PLC_ADDRESSES, AddressError, parse_address
from fbvm.base.arithmetic import Undefined
from fbvm.base.memory import Memory, changes, compare
from fbvm.base.types import ELEMENTARY, families_of

# --- strings ------------------------------------------------------------------------------------------------------------


@each_of("function, arguments, value", [
    ("left", (b"abcd", 2), b"ab"), ("left", (b"abcd", 0), b""), ("left", (b"abcd", 9), b"abcd"), ("left", (b"abcd", -1), None),
    ("right", (b"abcd", 1), b"d"), ("right", (b"abcd", 0), b""), ("right", (b"abcd", 9), b"abcd"), ("right", (b"abcd", -1), None),
    ("mid", (b"abcd", 2, 2), b"bc"), ("mid", (b"abcd", 0, 1), b""), ("mid", (b"abcd", 9, 4), b"d"), ("mid", (b"abcd", 1, 5), b""),
    ("mid", (b"abcd", 1, 0), None), ("mid", (b"abcd", -1, 1), None), ("insert", (b"abcd", b"x", 0), b"xabcd"),
    ("insert", (b"abcd", b"x", 4), b"abcdx"), ("insert", (b"abcd", b"x", 9), b"abcdx"), ("insert", (b"abcd", b"x", 1), b"axbcd"),
    ("insert", (b"abcd", b"x", -1), None), ("delete", (b"abcd", 2, 2), b"ad"), ("delete", (b"abcd", 0, 1), b"abcd"),
    ("delete", (b"abcd", 1, 5), b"abcd"), ("delete", (b"abcd", 1, 0), None), ("delete", (b"abcd", -1, 1), None),
    ("replace", (b"abcd", b"xyz", 1, 2), b"axyzcd"), ("replace", (b"abcd", b"x", 0, 1), b"xabcd"),
    ("replace", (b"abcd", b"x", 9, 9), b"abcdx"), ("replace", (b"abcd", b"x", 1, 0), None), ("find", (b"abcab", b"ab"), 1),
    ("find", (b"abcab", b"ca"), 3), ("find", (b"abc", b"x"), 0), ("find", (b"abc", b""), 0), ("find", (b"abc", b"abcd"), 0),
    ("characters", ("a\ud83d\ude00b",), 3), ("characters", ("\ude00\ud83d",), 2), ("characters", ("",), 0),
    ("units_of", ("a\ud83d\ude00b", 1), 1), ("units_of", ("a\ud83d\ude00b", 2), 3), ("units_of", ("a\ud83d\ude00b", 3), 4),
    ("units_of", ("a\ud83d\ude00b", 9), 4), ("units_of", ("abc", 0), 0), ("units_of", ("abc", -2), -2),
    ("units_of", ("abc", 2), 2),
    ("units_of", ("\ud83d\ude00\ud83d\ude00", 1), 2), ("units", (b"a\0\x3d\xd8\x00\xde",), "a\ud83d\ude00"),
    ("units", ("é€".encode("utf-16-le"),), "é€"), ("packed", ("a\ud83d",), b"a\0\x3d\xd8"), ("character", (65, False), b"A"),
    ("character", (0, False), b""), ("character", (0x20AC, True), "€"), ("character", (0, True), ""), ("first", (b"AB",), 65),
    ("first", ("€",), 0x20AC), ("first", (b"",), 0), ("widened", (b"\xe9",), "é"), ("narrowed", ("é€",), b"\xe9?"),
])
def test_functions_of_texts(function: str, arguments: tuple[Any, ...], value: Any) -> None:
    if value is None:
        with pytest.raises(Undefined) as undefined:
            getattr(strings, function)(*arguments)
        assert "R0108" in (undefined.value.args or ("",))[0] or getattr(undefined.value, "code", "") == "R0108"
    else:
        assert getattr(strings, function)(*arguments) == value


# --- numbers ------------------------------------------------------------------------------------------------------------


@each_of("value, shortest", [
    (0.1, "0.1"), (1 / 3, "0.33333334"), (16777216.0, "16777216.0"), (1e-45, "1e-45"), (3.4028235e38, "3.4028235e+38"),
    (-2.5, "-2.5"),
    (0.0, "0.0"), (math.inf, "inf"), (-math.inf, "-inf"), (123456.79, "123456.79"), (1.17549435e-38, "1.1754944e-38"),
])
def test_the_shortest_text_that_is_read_as_the_same_real(value: float, shortest: str) -> None:
    made = arithmetic.shortest(arithmetic.single(value))
    assert repr(made) == shortest and arithmetic.single(made) == arithmetic.single(value)
    assert math.isnan(arithmetic.shortest(math.nan)) and arithmetic.shortest(1 / 3) == 1 / 3


@each_of("name, value, answer", [
    ("sqrt", 4.0, 2.0), ("sqrt", -1.0, math.nan), ("ln", 1.0, 0.0), ("ln", 0.0, -math.inf), ("ln", -1.0, math.nan),
    ("log", 100.0, 2.0),
    ("log", 0.0, -math.inf), ("log", -0.5, math.nan), ("exp", 0.0, 1.0), ("exp", 1000.0, math.inf), ("sin", 0.0, 0.0),
    ("sin", math.inf, math.nan), ("cos", 0.0, 1.0), ("tan", 0.0, 0.0), ("asin", 1.0, math.pi / 2), ("asin", 2.0, math.nan),
    ("acos", 1.0, 0.0), ("acos", -2.0, math.nan), ("atan", math.inf, math.pi / 2),
])
def test_functions_outside_of_their_domain(name: str, value: float, answer: float) -> None:
    found = arithmetic.FUNCTIONS[name](value)
    assert found == answer or math.isnan(found) and math.isnan(answer), found


# --- types and addresses ------------------------------------------------------------------------------------------------


def test_the_families_of_a_type_are_those_of_figure_5() -> None:
    assert families_of("ANY_SIGNED") == {"ANY_SIGNED", "ANY_INT", "ANY_NUM", "ANY_MAGNITUDE", "ANY_ELEMENTARY", "ANY"}
    assert families_of("ANY_BIT") == {"ANY_BIT", "ANY_ELEMENTARY", "ANY"} and families_of("ANY") == {"ANY"}
    rows = {name: (kind.size, kind.machine, kind.low, kind.high, kind.bits) for name, kind in ELEMENTARY.items()}
    assert rows["BOOL"] == (1, "b", 0, 1, 1) and rows["CHAR"] == (1, "u8", 0, 255, 8) and rows["WCHAR"] == (2, "u16", 0, 65535,
    16)
    for bits, names in ((8, "SINT USINT BYTE"), (16, "INT UINT WORD"), (32, "DINT UDINT DWORD"), (64, "LINT ULINT LWORD")):
        signed, unsigned, string = names.split()
        assert rows[signed] == (bits // 8, f"i{bits}", -(1 << bits - 1), (1 << bits - 1) - 1, bits)
        assert rows[unsigned] == rows[string] == (bits // 8, f"u{bits}", 0, (1 << bits) - 1, bits)
    assert rows["REAL"][:2] == (4, "f32") and rows["LREAL"][:2] == (8, "f64") and rows["REAL"][4] == 32 and rows["LREAL"][4] == 64
    assert rows["LDT" if "LDT" in rows else "LDATE_AND_TIME"][:2] == rows["TIME"][:2] == (8, "i64")


@each_of("text, said", [
    ("%I5", "%I5 has no size: write %IX5.0 or %IW5"), ("%QX3.8", "bit"),
    ("%MW3.16", "bit 16 does not exist; bits of %MW3 are 0 to 15"),
    ("EG_0", "is not an address"), ("D32768", "D ends at 32767; 32768 does not exist"), ("CIO 6144", "CIO ends at 6143"),
    ("TF5.0", "is a flag and has no bits"), ("CIO 5.16", "bit 16 does not exist; bits are 0 to 15"),
])
def test_what_is_no_address_is_told_why(text: str, said: str) -> None:
    with pytest.raises(AddressError) as error:
        parse_address(text)
    assert said in str(error.value), str(error.value)


def test_where_index_registers_point() -> None:
    """From memory of the family, assumed: 4 K of flags each, then CIO, A, H, W, T, C and D; E banks behind D."""
    assert PLC_ADDRESSES == {"TF": 48640, "CNF": 48896, "CIO": 49152, "A": 55296, "H": 56320, "W": 56832, "T": 57344, "C": 61440,
                             "D": 65536}  # fmt: skip
    assert PLC_ADDRESSES["A"] - PLC_ADDRESSES["CIO"] == AREAS["CIO"].count
    assert PLC_ADDRESSES["D"] + AREAS["D"].count == E_PLC_ADDRESS
    assert PLC_ADDRESSES["T"] - PLC_ADDRESSES["W"] == AREAS["W"].count and E_WORDS == 32768


# --- memory -------------------------------------------------------------------------------------------------------------


def test_runs_of_bytes_that_differ_are_joined_over_halves_and_pages() -> None:
    old = bytearray(3 * 4096)
    new = bytearray(old)
    for start, size in ((0, 1), (2047, 2), (4095, 3), (8190, 2), (12287, 1)):
        new[start:start + size] = b"x" * size
    runs = [(0, 1), (2047, 2), (4095, 3), (8190, 2), (12287, 1)]
    assert changes(bytes(old), bytes(new)) == [(at, b"x" * size) for at, size in runs] and changes(bytes(old), bytes(old)) == []
    memory = Memory(3 * 4096, AREAS)
    before = memory.snapshot()
    memory.u8[:] = bytes(new)
    assert compare(before, memory.snapshot()) == runs and compare(before, before) == []


def test_texts_and_values_stop_at_the_end_of_the_memory() -> None:
    memory = Memory(4096, AREAS)
    memory.write_text(4085, 10, b"0123456789ab")
    assert memory.read_text(4085, 10) == b"0123456789" and memory.u8[4095] == 0
    memory.write(4092, "u32", 7)
    assert memory.read(4092, "u32") == 7
    for offset, machine in ((4093, "u32"), (-1, "u8"), (4096, "b")):
        with pytest.raises(IndexError):
            memory.read(offset, machine)
        with pytest.raises(IndexError):
            memory.write(offset, machine, 1)
    with pytest.raises(IndexError):
        memory.write_text(4086, 10, b"")
    with pytest.raises(ValueError, match="0 bytes are none"):
        Memory(0, AREAS)
    memory.u8[9] = 0xFF
    memory.write(9, "b", False, 3)
    assert (memory.u8[9], memory.read(9, "b", 3), memory.read(9, "b", 4)) == (0xF7, False, True)


# --- the host -----------------------------------------------------------------------------------------------------------

posix = pytest.mark.skipif(sys.platform == "win32", reason="signals are not held back here")


@posix
def test_signals_that_are_held_come_when_they_are_let_through() -> None:
    assert signal.SIGTERM not in signal.pthread_sigmask(signal.SIG_BLOCK, [])
    with host.signals_held():
        blocked = signal.pthread_sigmask(signal.SIG_BLOCK, [])
        assert {signal.SIGINT, signal.SIGTERM} <= blocked
        host.let_signals_through()
        assert not {signal.SIGINT, signal.SIGTERM} & signal.pthread_sigmask(signal.SIG_BLOCK, [])
    assert not {signal.SIGINT, signal.SIGTERM} & signal.pthread_sigmask(signal.SIG_BLOCK, [])


@posix
def test_ctrl_c_is_ignored_by_children_and_at_the_end() -> None:
    before = signal.getsignal(signal.SIGINT)
    with host.deaf_children():
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    assert signal.getsignal(signal.SIGINT) is before
    try:
        host.ignore([signal.SIGUSR2])
        assert signal.getsignal(signal.SIGUSR2) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGUSR2, signal.SIG_DFL)


def test_outside_of_the_main_thread_no_signal_is_handled() -> None:
    before, said = signal.getsignal(signal.SIGTERM), list[Any]()

    def other() -> None:
        with host.handling([signal.SIGTERM], lambda number, frame: None):
            said.append(signal.getsignal(signal.SIGTERM))

    thread = threading.Thread(target=other)
    thread.start()
    thread.join()
    assert said == [before] and signal.getsignal(signal.SIGTERM) is before


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells")
def test_bytes_that_were_not_sent_are_those_that_the_host_tells(monkeypatch: pytest.MonkeyPatch) -> None:
    import fcntl

    asked: list[tuple[int, int]] = []
    monkeypatch.setattr(fcntl, "ioctl", lambda number, what, room: asked.append((number, what)) or struct.pack("i", 77))
    assert host.unsent_bytes(5) == 77 and asked == [(5, host.SIOCOUTQNSD)]
    monkeypatch.undo()
    with socket.socket() as closed:
        number = closed.fileno()
    assert host.unsent_bytes(number) == 0
    monkeypatch.setattr(sys, "platform", "darwin")
    assert host.unsent_bytes(5) == 0


@each_of("machine, expected", [("x86_64", True), ("AMD64", True), ("aarch64", False), ("arm64", False)])
def test_which_processors_are_x86_64(machine: str, expected: bool) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("platform.machine", lambda: machine)
        assert host.is_x86_64() is expected


def test_a_file_that_may_not_be_written_is_not_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "kept.txt"
    path.write_text("before", encoding="utf-8")
    monkeypatch.setattr(os, "access", lambda name, how: how != os.W_OK)
    with pytest.raises(PermissionError) as refused:
        files.write_file(path, "after")
    assert refused.value.filename == str(path) and path.read_text() == "before" and list(tmp_path.iterdir()) == [path]


# --- folders and caches -------------------------------------------------------------------------------------------------


def test_folders_of_a_wheel_go_before_those_of_a_checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    find = data.data_folder.__wrapped__
    monkeypatch.setattr(data, "PACKAGE", tmp_path / "fbvm")
    with pytest.raises(FileNotFoundError, match=r"^grammar/ is missing from this installation of fbvm$"):
        find("grammar")
    (tmp_path / "grammar").mkdir()
    assert find("grammar") == tmp_path / "grammar"
    (tmp_path / "fbvm" / "_data" / "grammar").mkdir(parents=True)
    assert find("grammar") == tmp_path / "fbvm" / "_data" / "grammar"


def test_a_cache_that_is_off_neither_reads_nor_writes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FBVM_CACHE", str(tmp_path / "cache"))
    kept = cache.Cache("kind", b"head", 1 << 20)
    monkeypatch.setattr(cache, "_on", True)
    cache.switch(False)
    kept.write("name", b"content")
    assert not (tmp_path / "cache").exists()
    cache.switch(True)
    kept.write("name", b"content")
    assert kept.read("name") == b"content" and kept.read("other") is None
    cache.switch(False)
    assert kept.read("name") is None
    cache.switch(True)
    assert kept.read("name") == b"content" and cache.Cache("kind", b"tail", 1).read("name") is None
    path = kept.folder / "name"
    content = path.read_bytes()
    assert content.startswith(b"headcontent") and len(content) == len(b"headcontent") + 32
    path.write_bytes(content[:-1] + bytes((content[-1] ^ 1,)))
    assert kept.read("name") is None, "damaged"


def test_a_file_that_goes_meanwhile_is_not_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Entry:
        def __init__(self, name: str, size: int | None) -> None:
            self.path, self._size = name, size

        def stat(self) -> Any:
            if self._size is None:
                raise FileNotFoundError(self.path)
            return os.stat_result((0o600, 0, 0, 1, 0, 0, self._size, 5, 6, 7))

    class Entries(list[Entry]):
        def __enter__(self) -> Entries:
            return self

        def __exit__(self, *_: object) -> None:
            return

    monkeypatch.setattr(os, "scandir", lambda folder: Entries([Entry("a", 3), Entry("gone", None), Entry("b", 4)]))
    assert list(cache._files(tmp_path)) == [(6.0, 3, "a"), (6.0, 4, "b")]


def test_texts_of_which_a_name_is_made_are_told_apart() -> None:
    assert cache.name_of(["ab", "c"]) != cache.name_of(["a", "bc"]) != cache.name_of(["abc"])
    assert cache.name_of(["\ud800"]) == cache.name_of(["\ud800"]) and len(cache.name_of([])) == 64
