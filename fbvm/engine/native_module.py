"""An Image as one module of LLVM's language: its bodies, one entry a task, constants, and the routines that are called."""

from __future__ import annotations

import ast
import inspect
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from types import ModuleType

from fbvm.code.image import Image
from fbvm.engine import native_literals, native_reading, native_routines
from fbvm.engine.bases import fixed_bases
from fbvm.engine.native_context import Point
from fbvm.engine.native_expressions import VALUES
from fbvm.engine.native_statements import EMITTERS
from fbvm.engine.native_subset import Routine
from fbvm.engine.native_texts import TEXTS, from_text
from fbvm.engine.native_writer import METADATA, Module, Writer

SMALL, LARGE = 40, 600
"""Lines of LLVM up to which a body is always copied to where it is called, and from which on never."""
DEEPEST = 1_000_000
"""Python frames that writing deeply nested code may take."""
_FUNCTIONS = """\
declare void @llvm.memmove.p0.p0.i64(ptr, ptr, i64, i1)
declare void @llvm.memcpy.p0.p0.i64(ptr, ptr, i64, i1)
declare void @llvm.memset.p0.i64(ptr, i8, i64, i1)
declare double @llvm.sqrt.f64(double)
declare double @llvm.rint.f64(double)
declare double @llvm.trunc.f64(double)
declare float @llvm.fabs.f32(float)
declare double @llvm.fabs.f64(double)
declare double @fbvm_pow(double, double) #2
declare double @fbvm_atan2(double, double) #2
declare ptr @fbvm_double_to_string(double, i8 signext, i32, i32, ptr)
declare double @fbvm_string_to_double(ptr, ptr, ptr)
declare void @fbvm_free(ptr)
"""
MATH = ("ln", "log", "exp", "sin", "cos", "tan", "asin", "acos", "atan")
_WIDTHS = ("i1", "i8", "i16", "i32", "i64")
ATTRIBUTES = """\
attributes #0 = { nounwind }
attributes #1 = { nounwind noinline }
attributes #2 = { nounwind willreturn memory(none) }
attributes #3 = { nounwind alwaysinline }
attributes #4 = { nounwind noinline }
"""


@dataclass(frozen=True)
class Translation:
    """An image as LLVM: its text, the points at which a run can end, the size of the context."""

    text: str
    points: tuple[Point, ...]
    context_size: int


class BodyWriter(Writer):
    """A Writer that knows all rows."""

    values = {**VALUES, "from_text": from_text}
    texts = TEXTS
    statements = EMITTERS


def translate(image: Image) -> Translation:
    """The module of an image.  Raises Unsupported for code that the compiler never makes."""
    module = Module(image, fixed_bases(image), [], {}, set())
    with _deep():
        bodies = [_body(module, number) for number in range(len(image.bodies))]
    tasks = [_task(image, number) for number in range(len(image.tasks))]
    routines = list(_routines(module))
    constants = [f"{name} = private unnamed_addr constant [{len(value)} x i8] {_bytes(value)}"
                 for value, name in module.constants.items()]
    intrinsics = [f"declare {kind} @llvm.{name}.{kind}({kind}, {kind})"
                  for name in ("umin", "umax", "smin", "smax") for kind in _WIDTHS]
    intrinsics += [f"declare {kind} @llvm.{name}.{kind}({kind}, {kind}, {kind})"
                   for name in ("fshl", "fshr") for kind in _WIDTHS[1:]]
    intrinsics += [f"declare {kind} @llvm.abs.{kind}({kind}, i1)" for kind in _WIDTHS[1:]]
    intrinsics += [f"declare double @fbvm_{name}(double) #2" for name in MATH]
    text = "\n".join([*constants, *bodies, *tasks, *routines, _FUNCTIONS, *intrinsics, ATTRIBUTES, METADATA])
    return Translation(text, tuple(module.points), module.scratch)


@contextmanager
def _deep() -> Iterator[None]:
    before = sys.getrecursionlimit()
    sys.setrecursionlimit(max(before, DEEPEST))
    try:
        yield
    finally:
        sys.setrecursionlimit(before)


def _body(module: Module, number: int) -> str:
    w = BodyWriter(module, number)
    w.write(w.body.code)
    if not w.dead:
        w.emit("ret i32 0")
    lines = [f"{name} = alloca {kind}, align 8" for name, kind in w.temporaries.items()]
    if w.uses_instance:
        lines.append("%s = getelementptr inbounds i8, ptr %m, i64 %self")
    lines += w.lines + w.cold
    inline = "#3" if len(lines) <= SMALL else "#4" if len(lines) >= LARGE else "#0"
    shown = w.body.name.encode("unicode_escape").decode()
    return "\n".join([f"; {shown}", f"define internal i32 @b{number}(ptr noalias %m, ptr noalias %c, i64 %self) {inline} {{",
                      "entry:", *lines, "}"])


def _task(image: Image, number: int) -> str:
    lines = [f"define i32 @task{number}(ptr noalias %m, ptr noalias %c) #0 {{"]
    for place, run in enumerate(image.tasks[number].programs):
        lines += [f"%p{place} = call i32 @b{run.body}(ptr %m, ptr %c, i64 {run.offset})",
                  f"%t{place} = icmp ne i32 %p{place}, 0", f"br i1 %t{place}, label %x{place}, label %g{place}, !prof !0",
                  f"x{place}:", f"ret i32 %p{place}", f"g{place}:"]
    return "\n".join([*lines, "ret i32 0", "}"])


# --- routines -------------------------------------------------------------------------------------------------------


@cache
def _library() -> dict[str, tuple[ast.FunctionDef, ModuleType]]:
    """All routines by name."""
    found = {}
    for module in (native_routines, native_reading, native_literals):
        for node in ast.parse(inspect.getsource(module)).body:
            if isinstance(node, ast.FunctionDef):
                found[node.name] = node, module
    return found


def _routines(module: Module) -> Iterator[str]:
    """The routines that the bodies call, and those that these call."""
    waiting, seen = sorted(module.routines), set(module.routines)
    while waiting:
        function, source = _library()[waiting.pop(0)]
        routine = Routine(function, vars(source), lambda value: module.constant(value + b"\0"))
        yield "\n".join(routine.translate())
        waiting += sorted(routine.calls - seen)
        seen |= routine.calls


def _bytes(value: bytes) -> str:
    return 'c"' + "".join(f"\\{byte:02X}" for byte in value) + '"'
