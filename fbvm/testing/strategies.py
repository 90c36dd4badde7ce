"""Hypothesis strategies for PLC programs: values of a variable, inputs of a block, delays, whole courses of inputs.

    @given(courses(PUMP))
    def test_it_never_starts_at_once(course):
        pump = Rig.of("src/pump.st::Pump")
        ...

Needs the package hypothesis.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from hypothesis import strategies as st

from fbvm.base.types import (
    BOOL,
    ArrayType,
    Elementary,
    EnumType,
    StringType,
    StructType,
    SubrangeType,
    Type,
    base,
)
from fbvm.testing.rig import Rig, to_ns
from fbvm.testing.value_types import Nanoseconds
from fbvm.watch.paths import Place

LONGEST_NS = 3_600_000_000_000
"""An hour: times that a strategy gives are no longer."""
DURATIONS = frozenset(("TIME", "LTIME"))


def values(kind: Type) -> st.SearchStrategy[Any]:
    """Values of a data type, its edges among them."""
    if isinstance(kind, SubrangeType):
        return st.integers(kind.low, kind.high)
    plain = base(kind)
    if plain is BOOL:
        return st.booleans()
    if isinstance(plain, EnumType):
        return st.sampled_from(sorted(plain.shown))
    if isinstance(plain, StringType):
        return st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=plain.capacity)
    if isinstance(plain, ArrayType):
        return st.lists(values(plain.element), min_size=plain.count, max_size=plain.count)
    if isinstance(plain, StructType):
        return st.fixed_dictionaries({field.name: values(field.type) for field in plain.fields.values() if not field.constant})
    if isinstance(plain, Elementary) and "ANY_CHAR" in plain.families:
        return st.characters(min_codepoint=0, max_codepoint=plain.high, categories=("L", "N", "P", "S", "Z"))
    if isinstance(plain, Elementary) and plain.machine in ("f32", "f64"):
        return st.floats(width=32 if plain.machine == "f32" else 64)
    if isinstance(plain, Elementary) and plain.name in DURATIONS:
        return st.integers(0, LONGEST_NS).map(Nanoseconds)
    if isinstance(plain, Elementary):
        numbers = st.integers(plain.low, plain.high)
        return numbers.map(partial(Nanoseconds, kind=plain)) if "ANY_DATE" in plain.families else numbers
    raise TypeError(f"there are no values of {kind.name} to choose from")


def inputs(rig: Rig, **chosen: st.SearchStrategy[Any]) -> st.SearchStrategy[dict[str, Any]]:
    """Values of some inputs of a block at once, by name: `rig.write(...)` takes them.  `chosen` are strategies by name.

    In-outs are among them, EN too.  An input may be missing: it keeps its value."""
    found = _inputs(rig)
    unknown = sorted(set(chosen) - set(found))
    if unknown:
        raise ValueError(f"{rig.subject.name} has no input {', '.join(unknown)}; it has {', '.join(found)}")
    return st.fixed_dictionaries({}, optional={name: chosen.get(name, values(kind)) for name, kind in found.items()})


def _inputs(rig: Rig) -> Mapping[str, Type]:
    whole = rig.plc.find(rig.subject.prefix.rstrip("."))
    kind = whole.type if isinstance(whole, Place) else None
    fields = kind.fields.values() if isinstance(kind, StructType) else ()
    wanted = [field for field in fields if field.kind in ("VAR_INPUT", "VAR_IN_OUT")] or [
        field for field in fields if rig.subject.prefix.count(".") == 1 and field.kind == "VAR" and field.name != "Result"]
    return {field.name: field.type for field in wanted}


def delays(longest: str | int = "1s", step: str | int = "10ms") -> st.SearchStrategy[int]:
    """Times in nanoseconds in whole steps, short ones more often."""
    step_ns = to_ns(step)
    most = to_ns(longest) // step_ns
    return st.one_of(st.integers(0, min(3, most)), st.integers(0, most)).map(lambda count: Nanoseconds(count * step_ns))


def courses(rig: Rig, longest: str | int = "1s", most: int = 20, **chosen: st.SearchStrategy[Any]
            ) -> st.SearchStrategy[list[tuple[int, dict[str, Any]]]]:  # fmt: skip
    """A course of inputs: how long to run in nanoseconds, then what to write; `follow` does it."""
    step = st.tuples(delays(longest, rig.plc.cycle_ns), inputs(rig, **chosen))
    return st.lists(step, min_size=1, max_size=most)


def follow(rig: Rig, course: list[tuple[int, dict[str, Any]]]) -> Rig:
    """Runs a course; each of its inputs is there for one scan at least."""
    for delay_ns, written in course:
        if delay_ns:
            rig.run(delay_ns)
        rig.scan(written)
    return rig
