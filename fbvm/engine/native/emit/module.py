"""Translates an Image into one module of LLVM's language: bodies, a function for each task, constants, declarations."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property, partial
from types import MappingProxyType

from fbvm.base.areas import BUDGET, MOST_FRAMES
from fbvm.code.image import Image
from fbvm.code.operations import caught
from fbvm.engine.bases import fixed_bases, recursive_bodies
from fbvm.engine.depths import with_recursion_room
from fbvm.engine.native.emit import texts as native_texts
from fbvm.engine.native.emit.alias_scopes import METADATA, AliasScopes, resolved
from fbvm.engine.native.emit.call_graph import call_graph, heights, instance_places
from fbvm.engine.native.emit.context import Point
from fbvm.engine.native.emit.conversions import ONE_STEP
from fbvm.engine.native.emit.counting import Counting
from fbvm.engine.native.emit.expressions import VALUES
from fbvm.engine.native.emit.object_bounds import objects
from fbvm.engine.native.emit.statements import EMITTERS
from fbvm.engine.native.emit.step_charges import ASK
from fbvm.engine.native.emit.stop_checks import GUARD, at_end
from fbvm.engine.native.emit.writer import RARE, TRAPPED, Module, Writer
from fbvm.engine.native.library.library import declaration, definitions
from fbvm.engine.native.llvm.compiler import MATH
from fbvm.engine.stops import STOPPED

SMALL, LARGE = 40, 600
"""Lines of LLVM: up to SMALL a body that calls no other is always inlined, from LARGE on a body never is."""
ALIGN = 64
"""Functions begin at multiples of so many bytes: elsewhere the same code takes a sixth longer now and then."""
DEEP = 8
"""How many nested calls may be inlined into one function."""
FRAMES_A_LEVEL = 12
"""Python frames that translating takes at most for each level of nested code."""
_FUNCTIONS = """\
declare void @llvm.memmove.p0.p0.i64(ptr, ptr, i64, i1)
declare void @llvm.memcpy.p0.p0.i64(ptr, ptr, i64, i1)
declare void @llvm.memset.p0.i64(ptr, i8, i64, i1)
declare double @llvm.sqrt.f64(double)
declare float @llvm.rint.f32(float)
declare double @llvm.rint.f64(double)
declare i32 @llvm.lrint.i32.f32(float)
declare i32 @llvm.lrint.i32.f64(double)
declare i64 @llvm.lrint.i64.f32(float)
declare i64 @llvm.lrint.i64.f64(double)
declare float @llvm.fabs.f32(float)
declare double @llvm.fabs.f64(double)
"""
_OUTSIDE = re.compile(r"@((?:llvm|fbvm)[\w.]+)\(")
"""A function that a module calls, or declares, by a name that stands for all modules."""
_WIDTHS = ("i1", "i8", "i16", "i32", "i64")
# A body that others call keeps no registers for them (#6): to save and restore six takes longer than most calls.  LLVM knows
# that of a call, not of a jump at the end of a function that has to keep them, which `notail` forbids.
ATTRIBUTES = """\
attributes #0 = { nounwind }
attributes #1 = { nounwind noinline }
attributes #2 = { nounwind willreturn memory(none) }
attributes #3 = { nounwind alwaysinline }
attributes #4 = { nounwind noinline }
attributes #5 = { nounwind willreturn memory(read) }
attributes #6 = { nounwind "no_callee_saved_registers" }
"""


@dataclass(frozen=True)
class Translation:
    """An image as a module of LLVM, and what the engine has to know of it."""

    quick: str
    """The text of which quick code is made: alias scopes are comments in it."""
    regions: tuple[AliasScopes, ...]
    """The alias scopes of its bodies."""
    points: tuple[Point, ...]
    """The points at which a run can end early; point n is `points[n - 1]`."""
    kept_bytes: int
    """Bytes of the context in front of its fields."""
    context_bytes: int
    """Bytes of the context from its fields on."""
    counting: list[object]
    """Facts about its counters (`Counting.facts`), none for code that counts nothing."""
    marks_at: int
    """Where the notes of power begin in the context."""
    routines: tuple[str, ...]
    """Names of the library's routines that it calls."""

    @cached_property
    def text(self) -> str:
        """The text of which fast code is made: with alias scopes."""
        return resolved(self.quick, self.regions)


class BodyWriter(Writer):
    """A Writer with the rows of all operations."""

    values: Mapping[str, Callable[..., str]] = MappingProxyType({**VALUES, **native_texts.VALUES})
    texts = native_texts.TEXTS
    statements = EMITTERS


def translate(image: Image, stops: bool = False) -> Translation:
    """Translates an image; with `stops`, so that its runs can be stopped at observations.

    Raises Unsupported for code that the compiler never makes."""
    return with_recursion_room(image, FRAMES_A_LEVEL, partial(_translated, image, stops))


def _translated(image: Image, stops: bool) -> Translation:
    graph, recursive = call_graph(image), recursive_bodies(image)
    module = Module(image, fixed_bases(image), instance_places(image, graph, recursive), heights(graph), [], {}, set(),
                    stops, recursive)
    if image.counters:
        counting = module.counting = Counting(image, MOST_FRAMES if recursive else 0)
        counting.offset = module.room(counting.bytes)
    if image.marks:
        module.marks_at = module.room(-(-image.marks // 16) * 16)
    bodies = [_body(module, number) for number in module.heights]
    tasks = [_task(module, number) for number in range(len(image.tasks))]
    rows = [f"i32 {caught(code, True)}" for code, _, _ in module.points] if module.attempts else []
    table = f"@caught = internal constant [{len(rows) + 1} x i32] [{', '.join(['i32 0', *rows])}]"
    routines = [declaration(name) for name in sorted(module.routines)]
    text = "\n".join([*definitions(module.constants), objects(image.objects), *[table] * module.attempts, *bodies, *tasks,
                      *routines, ASK, ATTRIBUTES, METADATA, *[GUARD] * stops])
    known = _declarations()
    text = "\n".join([text, *(known[name] for name in sorted(set(_OUTSIDE.findall(text)) & known.keys()))])
    return Translation(text, tuple(module.regions), tuple(module.points), -(-module.kept_bytes // 16) * 16, module.scratch_end,
                       module.counting.facts if module.counting else [], module.marks_at,
                       tuple(sorted(module.routines)))


@cache
def _declarations() -> dict[str, str]:
    """By name the declarations of functions that modules call: LLVM's intrinsics, and those of C's math.h.

    A module has those of the functions that it calls: a hundred more take LLVM a third of its time for a small one."""
    lines = _FUNCTIONS.splitlines()
    lines += [f"declare {kind} @llvm.{name}.{kind}({kind}, {kind})"
              for name in ("umin", "umax", "smin", "smax") for kind in _WIDTHS]
    lines += [f"declare {kind} @llvm.{name}.{kind}({kind}, {kind}, {kind})"
              for name in ("fshl", "fshr") for kind in _WIDTHS[1:]]
    lines += [f"declare {kind} @llvm.x86.{extension}.{how}s{letter}2si{suffix}({lanes})" for how in ("cvt", "cvtt")
              for extension, letter, lanes in (("sse", "s", "<4 x float>"), ("sse2", "d", "<2 x double>"))
              for kind, suffix in (("i32", ""), ("i64", "64")) if ONE_STEP]
    lines += [f"declare {kind} @llvm.abs.{kind}({kind}, i1)" for kind in _WIDTHS[1:]]
    lines += [f"declare double @fbvm_{name}({', '.join(['double'] * count)}) #2" for name, count in MATH.items()]
    return {name: line for line in lines for name in _OUTSIDE.findall(line)}


def _body(module: Module, number: int) -> str:
    w = BodyWriter(module, number)
    w.write(w.body.code)
    if not w.dead:
        w.give_back()
    lines = [f"{name} = alloca {kind}, align 8" for name, kind in (w.temporaries | w.kept_texts).items()]
    lines += ["%budget = alloca i64", "store i64 %left, ptr %budget"]
    if w.uses_instance:
        lines.append("%s = getelementptr inbounds i8, ptr %m, i64 %self")
    lines += w.lines + w.cold
    apart = len(lines) >= LARGE or module.heights[number] % DEEP == DEEP - 1
    starts = any(run.body == number for task in module.image.tasks for run in task.programs)
    inline = "#4" if apart else "#3" if not module.heights[number] and len(lines) <= SMALL else "#0" if starts else "#6"
    shown = w.body.name.encode("unicode_escape").decode()
    return "\n".join([
        f"; {shown}", f"define internal fastcc i64 @b{number}(ptr noalias %m, ptr noalias %c, i64 %self, i64 %left) "
        f"{inline} align {ALIGN} {{", "entry:", *lines, "}"])


def _task(module: Module, number: int) -> str:
    image = module.image
    point = module.point(STOPPED, 0, ()) if module.stops else 0
    lines = [f"define i32 @task{number}(ptr noalias %m, ptr noalias %c) #0 align {ALIGN} {{",
             f"%w = getelementptr inbounds i8, ptr %m, i64 {BUDGET}", "%b0 = load i64, ptr %w"]
    for n, run in enumerate(image.tasks[number].programs):
        lines += [f"%b{n + 1} = call fastcc i64 @b{run.body}(ptr %m, ptr %c, i64 {run.offset}, i64 %b{n})",
                  f"%t{n} = icmp slt i64 %b{n + 1}, {TRAPPED}", f"br i1 %t{n}, label %x{n}, label %g{n}, {RARE}",
                  f"x{n}:", f"%p{n} = trunc i64 %b{n + 1} to i32", f"ret i32 %p{n}", f"g{n}:"]
        lines += at_end(n, len(image.sites), point) if module.stops else []
    return "\n".join([*lines, "ret i32 0", "}"])
