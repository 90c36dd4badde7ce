"""Two blocks beside each other: a program that calls both with the same inputs, and the property that all outputs agree.

Blocks are compared from power-on, each called once a scan.  In-outs of either are variables of their own, which begin alike and
are compared as outputs are."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from fbvm.base.diagnostics import Source
from fbvm.base.types import ArrayType, StructType, Type, fold
from fbvm.check.symbols.library import Libraries
from fbvm.check.symbols.report import Report
from fbvm.code.image import Image
from fbvm.prove.question import ALWAYS, Question
from fbvm.syntax import tree
from fbvm.syntax.parser import parse
from fbvm.watch.paths import Place, element, find_place, member

PROGRAM = "Equal"
"""The program that calls both."""
SIDES = ("Left", "Right")
MOST_OUTPUTS = 400

Pins = dict[str, str]
"""Names and types, as written, of the variables of a section."""


class Unlike(Exception):
    """Two blocks cannot be compared; the message says why."""


@dataclass(frozen=True)
class Block:
    """A function block or a function, with its pins."""

    name: str
    kind: str
    inputs: Pins
    outputs: Pins
    in_outs: Pins
    result: str


def pair(sources: Sequence[Source], names: tuple[str, str], libraries: Sequence[Path] = ()) -> Source:
    """The text of the program that calls both POUs of these names, which the sources or libraries declare.

    Raises Unlike for POUs that do not have the same pins."""
    left, right = (_block(sources, name, libraries) for name in names)
    for what, one, other in (("inputs", left.inputs, right.inputs), ("outputs", left.outputs, right.outputs),
                             ("in-outs", left.in_outs, right.in_outs)):  # fmt: skip
        if {fold(name) for name in one} != {fold(name) for name in other}:
            raise Unlike(f"{left.name} and {right.name} have other {what}: {_listed(one)}; {_listed(other)}")
    if bool(left.result) != bool(right.result):
        raise Unlike(f"{left.name} is a {left.kind}, {right.name} a {right.kind}")
    declared = "".join(f"    {name} : {kind};\n" for name, kind in left.inputs.items())
    own = "".join(_declarations(block, side) for block, side in zip((left, right), SIDES, strict=True))
    calls = "".join(f"    {_call(block, side)};\n" for block, side in zip((left, right), SIDES, strict=True))
    return Source("<equal>", f"PROGRAM {PROGRAM}\nVAR_INPUT\n{declared}END_VAR\nVAR\n{own}END_VAR\n{calls}END_PROGRAM\n")


def _listed(pins: Pins) -> str:
    return ", ".join(pins) or "none"


def _declarations(block: Block, side: str) -> str:
    """What the program declares for one side: the instance, or variables for what a function gives, and in-outs."""
    rows = {f"{side}_{name}": kind for name, kind in block.in_outs.items()}
    if block.kind == "FUNCTION_BLOCK":
        rows[side] = block.name
    else:
        rows |= {f"{side}_{name}": kind for name, kind in block.outputs.items()}
        rows[f"{side}_Result"] = block.result or "BOOL"
    return "".join(f"    {name} : {kind};\n" for name, kind in rows.items())


def _call(block: Block, side: str) -> str:
    given = [f"{name} := {name}" for name in block.inputs] + [f"{name} := {side}_{name}" for name in block.in_outs]
    if block.kind == "FUNCTION_BLOCK":
        return f"{side}({', '.join(given)})"
    given += [f"{name} => {side}_{name}" for name in block.outputs]
    return f"{side}_Result := " * bool(block.result) + f"{block.name}({', '.join(given)})"


def _block(sources: Sequence[Source], name: str, libraries: Sequence[Path]) -> Block:
    for source in sources:
        for node in parse(source)[0].everything():
            if isinstance(node, tree.Pou) and fold(node.name.text) == fold(name):
                return _read(node, source)
    shelves, report = Libraries(libraries), Report()
    for owner in shelves.names:
        for source, text in shelves.load(name, owner, report):
            for node in text.everything():
                if isinstance(node, tree.Pou) and fold(node.name.text) == fold(name):
                    return _read(node, source)
    raise Unlike(f"there is no {name} in the files, nor in a library")


def _read(node: tree.Pou, source: Source) -> Block:
    if node.kind == "PROGRAM":
        raise Unlike(f"{node.name.text} is a PROGRAM: --equal compares function blocks and functions")
    result = source.text[node.result.start : node.result.end] if node.result else ""
    inputs, outputs, in_outs = (_pins(node, kind, source) for kind in ("VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT"))
    return Block(node.name.text, node.kind, inputs, outputs, in_outs, result)


def _pins(node: tree.Pou, kind: str, source: Source) -> Pins:
    return {name.text: source.text[row.spec.start : row.spec.end] for section in node.sections if section.kind == kind
            for row in section.variables for name in row.names}  # fmt: skip


# --- the property -----------------------------------------------------------------------------------------------------


def equality(image: Image, names: tuple[str, str], assumptions: tuple[str, ...] = ()) -> Question:
    """The question whether all outputs of both sides are equal behind every scan of the program of `pair`.

    Raises Unlike for outputs that cannot be compared."""
    program = find_place(image.symbols, image.layout.areas, PROGRAM)
    assert isinstance(program.type, StructType)
    own = {fold(field.name): field.name for field in program.type.fields.values()}
    pairs: list[tuple[Place, Place]] = []
    if fold(SIDES[0]) in own:
        block = member(program, SIDES[0]).type
        assert isinstance(block, StructType)
        outputs = [field.name for field in block.fields.values() if field.kind == "VAR_OUTPUT"]
        pairs += [(member(member(program, SIDES[0]), name), member(member(program, SIDES[1]), name)) for name in outputs]
    beside = [name for name in own.values() if name.upper().startswith(f"{SIDES[0].upper()}_")]
    pairs += [(member(program, name), member(program, SIDES[1] + name[len(SIDES[0]):])) for name in beside]
    leaves = [each for left, right in pairs for each in zip(_leaves(left), _leaves(right), strict=True)]
    if not leaves or len(leaves) > MOST_OUTPUTS:
        raise Unlike(f"{names[0]} and {names[1]} have {len(leaves)} outputs to compare; 1 to {MOST_OUTPUTS} are possible")
    text = " AND ".join(_equal(left, right) for left, right in leaves)
    return Question(ALWAYS, text, assumptions, prefix=f"{PROGRAM}.", title=f"{names[0]} and {names[1]} are equal")


def _leaves(place: Place) -> Iterator[Place]:
    """The single values of a variable."""
    kind: Type = place.type
    if isinstance(kind, ArrayType):
        for number in range(kind.count):
            yield from _leaves(element(place, kind, number))
    elif isinstance(kind, StructType):
        for field in kind.fields.values():
            yield from _leaves(member(place, field.name))
    else:
        yield place


def _equal(left: Place, right: Place) -> str:
    """Two values are equal; of REALs also if both are NaN."""
    if left.type.name in ("REAL", "LREAL"):
        return f"({left.name} = {right.name} OR {left.name} <> {left.name} AND {right.name} <> {right.name})"
    return f"{left.name} = {right.name}"
