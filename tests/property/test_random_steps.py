"""One scan of random programs from random states: the terms of the prover and both engines leave the same memory.

States that no run from power-on gets to are states that induction begins with."""

from __future__ import annotations

from collections.abc import Iterator
from random import Random

import pytest
import st_programs
from depth import times
from encoded import Encoded, differences
from test_random_proofs import Maker

from fbvm.base.types import ArrayType, Elementary, StructType, Type
from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.prove.encoding.execution import Refused
from fbvm.watch.paths import Place, element, find_place, member

pytestmark = pytest.mark.slow
PROGRAMS, STATES = 12, 3
"""Programs of each kind, and states of each; 300 programs with 40 states each with --deep."""
DEEP_PROGRAMS, DEEP_STATES = 25, 13
CYCLE_NS, BUDGET = 10_000_000, 20_000
EDGES = 3
"""One value of so many is one of the edges of its type."""


def leaves(place: Place) -> Iterator[Place]:
    """The numbers and BOOLs of a variable, also those inside of instances."""
    kind: Type = place.type
    if isinstance(kind, StructType):
        for field in kind.fields.values():
            if not field.reference:
                yield from leaves(member(place, field.name))
    elif isinstance(kind, ArrayType):
        for number in range(kind.count):
            yield from leaves(element(place, kind, number))
    elif isinstance(kind, Elementary) and kind.machine[0] in "biu":
        yield place


def value(type: Elementary, random: Random) -> int:
    """A number that a variable of the type may hold, as the bits of its memory."""
    width = 1 if type.machine == "b" else 8 * type.size
    if random.randrange(EDGES):
        return random.getrandbits(width)
    return random.choice([0, 1, random.randrange(10), (1 << width) - 1, 1 << (width - 1), (1 << (width - 1)) - 1]) % (1 << width)


def write(plc: Plc, place: Place, bits: int) -> None:
    data = plc.memory.u8
    if place.bit is None:
        data[place.offset : place.offset + place.type.size] = bits.to_bytes(place.type.size, "little")
    else:
        data[place.offset] = data[place.offset] & ~(1 << place.bit) | bits << place.bit


def begun(image: Image, scans: int) -> tuple[list[Plc], Encoded, int]:
    """A PLC of each engine and the encoder behind so many scans, behind none if one of them traps; and how many these are."""
    plcs = [Plc(image, CYCLE_NS, budget=BUDGET, engine=engine) for engine in ("python", "native")]
    encoded = Encoded(image, CYCLE_NS, BUDGET)
    for scan in range(scans):
        encoded.scan(scan, bytes(plcs[0].memory.u8))
        traps = [plc.scan() for plc in plcs]
        if any(traps):
            return begun(image, 0)
    return plcs, encoded, scans


def compare_steps(image: Image, program: str, seed: int, states: int) -> None:
    """Asserts that a scan from each of some random states leaves the same on all three."""
    places = [*leaves(find_place(image.symbols, image.layout.areas, program))]
    for number in range(states):
        random = Random(f"{seed} {number}")
        plcs, encoded, scans = begun(image, number % 4)
        drawn = {place: value(place.type, random) for place in places if isinstance(place.type, Elementary)}
        for plc in plcs:
            for place, bits in drawn.items():
                write(plc, place, bits)
        memory = bytes(plcs[0].memory.u8)
        scanned = encoded.scan(scans, memory)
        for plc in plcs:
            plc.scan()
            assert differences(scanned, memory, plc) == [], (seed, number, {place.name: bits for place, bits in drawn.items()})


def test_programs_with_blocks_from_random_states() -> None:
    for seed in range(times(PROGRAMS, DEEP_PROGRAMS)):
        text = Maker(seed).text()
        image = compile_text(text, lint=False).image
        assert image is not None, text
        compare_steps(image, "Main", seed, times(STATES, DEEP_STATES))


def test_programs_with_all_kinds_of_operations_from_random_states() -> None:
    refused = 0
    for seed in range(times(PROGRAMS, DEEP_PROGRAMS)):
        image = compile_text(st_programs.text_of(st_programs.made(seed))[0]).image
        if image is not None:
            try:
                compare_steps(image, image.tasks[0].programs[0].name, seed, times(STATES, DEEP_STATES))
            except Refused:
                refused += 1
    assert refused <= times(PROGRAMS, DEEP_PROGRAMS) // 4
