"""Routines written in the subset do the same in Python and in machine code."""

from __future__ import annotations

import ast
import ctypes
import random
from typing import Any

import pytest
from depth import times
from rows import each_of

from fbvm.base import strings
from fbvm.engine.native import engine as native
from fbvm.engine.native.library import routines

if not native.available():
    pytest.skip("llvmlite is not installed", allow_module_level=True)

from fbvm.engine.native.library.library import PARTS, parts_of, routines_of
from fbvm.engine.native.library.subset import Routine
from fbvm.engine.native.llvm.compiler import Linked, compile_text


def compiled(source: str, **names: Any) -> Any:
    """A function of the subset as machine code; it stays for the test's time."""
    function = ast.parse(source).body[0]
    assert isinstance(function, ast.FunctionDef)
    constants: list[bytes] = []
    lines = Routine(function, names, lambda value: constants.append(value) or f"@k{len(constants) - 1}").translate()  # type: ignore[func-returns-value]
    texts = [f'@k{n} = private constant [{len(v) + 1} x i8] c"{v.decode()}\\00"' for n, v in enumerate(constants)]
    linked = Linked(compile_text("\n".join([*texts, *lines, "attributes #1 = { nounwind }"]), 0), [function.name])
    count = len(function.args.args)
    call = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_int64] * count)(linked.address(function.name))
    call.linked = linked  # type: ignore[attr-defined]
    return call


COLLATZ = """
def steps(n, most):
    count = 0
    while n != 1 and count < most:
        if n % 2 == 0:
            n //= 2
        elif not n < 0 or n == 0:
            n = 3 * n + 1
        else:
            break
        count += 1
        if count == 5:
            continue
    return count
"""


@each_of("n", [1, 2, 7, 27, 97])
def test_control_flow(n: int) -> None:
    space: dict[str, Any] = {}
    exec(COLLATZ, space)
    assert compiled(COLLATZ)(n, 1000) == space["steps"](n, 1000)


@pytest.mark.slow
@each_of("expression", [
    "a + b * 2", "a - b", "a << b", "a | b ^ 1 & 7", "-a", "(a < b) + 1", "1 <= a <= 5", "1 <= a <= b <= 7", "LIMIT",
    "ord('x')", "a // 2", "a % 3", "a >> 1", "(a == b) + (a != b) * 2 + (a >= 5) * 4 + (b > a) * 8",
])  # fmt: skip
def test_expressions(expression: str) -> None:
    values = {"a": 5, "b": 8, "LIMIT": 99}
    assert compiled(f"def f(a, b):\n    return {expression}", LIMIT=99)(5, 8) == eval(expression, values)


def test_division_takes_numbers_as_unsigned() -> None:
    assert compiled("def f(a):\n    return a // 10")(-6) == (2**64 - 6) // 10


def test_bytes_are_reached() -> None:
    buffer = ctypes.create_string_buffer(b"hello")
    upper = compiled("def f(at):\n    poke(at, peek(at) - 32)\n    return peek(data(b'q') + 0)")
    assert upper(ctypes.addressof(buffer)) == ord("q")
    assert buffer.value == b"Hello"


def test_what_falls_off_the_end_yields_zero() -> None:
    assert compiled("def f(a):\n    a = 3")(1) == 0


def test_routines_run_in_python_too() -> None:
    out = ctypes.create_string_buffer(64)
    at = ctypes.addressof(out)
    assert routines.put_time(at, -90_061_000_000_000) == len(b"T#-1d1h1m1s") and out.value == b"T#-1d1h1m1s"
    ctypes.memset(at, 0, 64)
    assert routines.put_real(at, 0x3FB99999A0000000) == 3 and out.value == b"0.1"


def test_a_part_calls_only_parts_before_it() -> None:
    assert parts_of([]) == [] and parts_of(["put_real"]) == [0] and parts_of(["read_value", "put_real"]) == [0, 1]
    assert len({name for part in range(len(PARTS)) for name in routines_of(part)}) == sum(
        len(routines_of(part)) for part in range(len(PARTS)))


# --- bytes and characters -----------------------------------------------------------------------------------------------


WIDE = ["", "a", "ab", "a\xe9", "a\u20acb", "\U0001f600", "a\U0001f600b\U0001f600", "\ud83d", "\ud83dx", "\ude00\ud83d",
        "\ud83d\ud83d\ude00", "\udbff\udfff", "b"]


def at(content: bytes) -> int:
    """The address of bytes that stay for the test's time."""
    KEPT.append(ctypes.create_string_buffer(content, len(content) + 8))
    return ctypes.addressof(KEPT[-1])


KEPT: list[Any] = []


@each_of("text", WIDE)
def test_characters_of_two_bytes_are_counted_as_the_python_engine_counts_them(text: str) -> None:
    units = text.encode("utf-16-le", "surrogatepass")
    count, place = len(units) // 2, at(units)
    assert routines.wide_length(place, 40) == count and routines.wide_length(place, 1) == min(count, 1)
    assert routines.wide_characters(place, count) == strings.characters(strings.units(units))
    for number in range(-1, count + 2):
        assert routines.wide_units(place, count, number) == strings.units_of(strings.units(units), number), number


def sign(number: int) -> int:
    return (number > 0) - (number < 0)


@pytest.mark.parametrize("width", [1, 2])
def test_texts_are_ordered_by_their_codes(width: int) -> None:
    form, routine = (("latin-1", routines.text_order), ("utf-16-le", routines.wide_order))[width - 1]
    texts = ["", "a", "b", "ab", "ac", "abc", "\xff", "a\xff"] + (["\u0161", "a\u0100"] if width == 2 else [])
    for one in texts:
        for other in texts:
            a, b = one.encode(form), other.encode(form)
            order = routine(at(a), len(one), at(b), len(other))
            assert sign(order) == (one > other) - (one < other), (one, other)


def test_characters_are_made_wide_and_narrow() -> None:
    wide = at(b".....")
    assert routines.widen(wide, at(b"a\xe9"), 2) == 2 and ctypes.string_at(wide, 5) == b"a\0\xe9\0."
    narrow = at(b"....")
    assert routines.narrow(narrow, at("a\u20ac\xe9".encode("utf-16-le")), 3) == 3
    assert ctypes.string_at(narrow, 4) == b"a?\xe9."


@each_of("count, stride, size", [(1, 2, 2), (1, 4, 4), (3, 8, 8), (2, 3, 3), (2, 8, 2), (0, 2, 2), (3, 5, 1)])
def test_bytes_of_items_are_reversed(count: int, stride: int, size: int) -> None:
    content = bytearray(range(1, 41))
    place = at(bytes(content))
    assert routines.reverse_items(place, count, stride, size) == 0
    for item in range(count):
        content[item * stride : item * stride + size] = content[item * stride : item * stride + size][::-1]
    assert ctypes.string_at(place, 40) == content


@each_of("number", [0, 1, 9, 10, 99, 100, 12345678, 10**16 - 1])
def test_decimal_digits_are_nibbles(number: int) -> None:
    assert routines.bcd_digits(number) == int(str(number), 16) and routines.bcd_number(int(str(number), 16)) == number
    assert routines.bcd_number(int(str(number), 16) & ~15 | 10) == -1


# --- search -----------------------------------------------------------------------------------------------------------


def found(routine: Any, text: bytes, wanted: bytes, width: int) -> int:
    one, two = ctypes.create_string_buffer(text), ctypes.create_string_buffer(wanted)
    at = routine(ctypes.addressof(one), len(text) // width, ctypes.addressof(two), len(wanted) // width, width)
    return int(at)


def expected(text: bytes, wanted: bytes, width: int) -> int:
    form = {1: "latin-1", 2: "utf-16-le"}[width]
    return text.decode(form).find(wanted.decode(form)) + 1 if wanted else 0


@each_of(("text", "wanted", "place"), [
    (b"ababbaabba", b"aabba", 6), (b"ababaab", b"aab", 5), (b"bbaaaba", b"aba", 5), (b"baa", b"a", 2), (b"baa", b"", 0),
    (b"", b"a", 0), (b"a", b"a", 1), (b"ab", b"aba", 0), (b"abc", b"c", 3),
])
def test_a_search_leaves_no_place_out(text: bytes, wanted: bytes, place: int) -> None:
    assert found(routines.text_find, text, wanted, 1) == place
    wide = [one.decode().encode("utf-16-le") for one in (text, wanted)]
    assert found(routines.text_find, *wide, 2) == place


@pytest.mark.slow
@pytest.mark.parametrize("width", [1, 2])
def test_a_search_finds_what_python_finds(width: int) -> None:
    numbers = random.Random(width)
    letters = [b"a".ljust(width, b"\0"), b"b".ljust(width, b"\1"), b"c".ljust(width, b"\0")]
    for _ in range(times(1500)):
        kinds = letters[:numbers.randint(1, 3)]
        text = b"".join(numbers.choices(kinds, k=numbers.randint(0, 24)))
        wanted = b"".join(numbers.choices(kinds, k=numbers.randint(0, 7))) * numbers.randint(1, 3)
        assert found(routines.text_find, text, wanted, width) == expected(text, wanted, width), (text, wanted)


@each_of(("text", "wanted"), [
    (b"a" * 400, b"a" * 100 + b"b"), (b"a" * 400, b"b" + b"a" * 100), (b"ab" * 200, b"ab" * 60 + b"b"),
    (b"a" * 400, b"a" * 60 + b"b" + b"a" * 60), (b"aab" * 150, b"aab" * 30 + b"aaa"),
    (b"a" * 400, b"c"), (b"a" * 399 + b"b", b"ab"),
])  # fmt: skip
def test_the_time_of_a_search_grows_with_the_texts_and_not_with_their_product(
        text: bytes, wanted: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    reads = 0
    peek = routines.peek

    def counted(at: int) -> int:
        nonlocal reads
        reads += 1
        return peek(at)

    monkeypatch.setattr(routines, "peek", counted)
    found(routines.text_find, text, wanted, 1)
    assert reads < 6 * (len(text) + len(wanted))
