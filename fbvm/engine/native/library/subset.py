"""Translates a small subset of Python into functions of LLVM.  The library of machine code is written in it.

All values are 64-bit numbers; `//`, `%` and `>>` take them as unsigned, comparisons as signed.  The subset has assignments,
if, while, break, continue, return, calls of other routines and of the functions below.  A routine also runs in Python, on
addresses of the host, which is how it is tested against its translation."""

from __future__ import annotations

import ast
import ctypes
import struct
from collections.abc import Callable, Mapping
from typing import Any

from fbvm.base.arithmetic import single

_ALIVE: dict[bytes, Any] = {}


def peek(at: int) -> int:
    """The byte at an address."""
    return ctypes.c_uint8.from_address(at).value


def poke(at: int, value: int) -> None:
    """Write a byte."""
    ctypes.c_uint8.from_address(at).value = value


def peek_all(at: int) -> int:
    """Eight bytes as a number."""
    return ctypes.c_int64.from_address(at).value


def poke_all(at: int, value: int) -> None:
    """Write eight bytes."""
    ctypes.c_uint64.from_address(at).value = value & (1 << 64) - 1


def data(content: bytes) -> int:
    """The address of constant bytes."""
    return ctypes.addressof(_ALIVE.setdefault(content, ctypes.create_string_buffer(content)))


def float_bits(number: int) -> int:
    """The bits of the double nearest to a signed number."""
    return _bits(float(number))


def single_bits(bits: int) -> int:
    """The bits of a double rounded to 32 bits."""
    return _bits(single(_double(bits)))


def float_text(bits: int, form: int, digits: int, flags: int) -> int:
    """The address of a double's text, ended by 0, as `PyOS_double_to_string` makes it; `free_text` gives it back."""
    write = ctypes.pythonapi.PyOS_double_to_string
    write.restype = ctypes.c_void_p
    write.argtypes = [ctypes.c_double, ctypes.c_char, ctypes.c_int, ctypes.c_int, ctypes.c_void_p]
    return int(write(_double(bits), form, digits, flags, None))


def text_float(at: int) -> int:
    """The bits of the double that a decimal text, ended by 0, is nearest to."""
    return _bits(float(ctypes.string_at(at)))


def _bits(value: float) -> int:
    """The bits of a double as a signed number."""
    return int.from_bytes(struct.pack("<d", value), "little", signed=True)


def _double(bits: int) -> float:
    """The double with these bits."""
    value: float = struct.unpack("<d", struct.pack("<q", bits))[0]
    return value


def free_text(at: int) -> None:
    """Give back what `float_text` made."""
    free = ctypes.pythonapi.PyMem_Free
    free.argtypes, free.restype = [ctypes.c_void_p], None
    free(at)


_INLINE = {
    "peek": ("{u}p = inttoptr i64 {0} to ptr", "{u}b = load i8, ptr {u}p", "{u}r = zext i8 {u}b to i64"),
    "poke": ("{u}p = inttoptr i64 {0} to ptr", "{u}b = trunc i64 {1} to i8", "store i8 {u}b, ptr {u}p"),
    "peek_all": ("{u}p = inttoptr i64 {0} to ptr", "{u}r = load i64, ptr {u}p, align 1"),
    "poke_all": ("{u}p = inttoptr i64 {0} to ptr", "store i64 {1}, ptr {u}p, align 1"),
    "float_bits": ("{u}d = sitofp i64 {0} to double", "{u}r = bitcast double {u}d to i64"),
    "single_bits": ("{u}d = bitcast i64 {0} to double", "{u}f = fptrunc double {u}d to float",
                    "{u}g = fpext float {u}f to double", "{u}r = bitcast double {u}g to i64"),
    "float_text": ("{u}d = bitcast i64 {0} to double", "{u}c = trunc i64 {1} to i8", "{u}n = trunc i64 {2} to i32",
                   "{u}o = trunc i64 {3} to i32", "{u}p = call ptr @fbvm_double_to_string(double {u}d, i8 signext {u}c, "
                   "i32 {u}n, i32 {u}o, ptr null)", "{u}r = ptrtoint ptr {u}p to i64"),
    "text_float": ("{u}p = inttoptr i64 {0} to ptr", "{u}d = call double @fbvm_string_to_double(ptr {u}p, ptr null, "
                   "ptr null)", "{u}r = bitcast double {u}d to i64"),
    "free_text": ("{u}p = inttoptr i64 {0} to ptr", "call void @fbvm_free(ptr {u}p)"),
}
"""The functions above as instructions: {u} begins the names of one use, {u}r is what it yields."""
OUTSIDE = ("declare ptr @fbvm_double_to_string(double, i8 signext, i32, i32, ptr)",
           "declare double @fbvm_string_to_double(ptr, ptr, ptr)", "declare void @fbvm_free(ptr)")
"""Functions outside that these instructions call."""
_SIGNS: dict[type, str] = {
    ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.FloorDiv: "udiv", ast.Mod: "urem", ast.BitAnd: "and",
    ast.BitOr: "or", ast.BitXor: "xor", ast.LShift: "shl", ast.RShift: "lshr",
    ast.Eq: "eq", ast.NotEq: "ne", ast.Lt: "slt", ast.LtE: "sle", ast.Gt: "sgt", ast.GtE: "sge",
}


class Routine:
    """Translates one function.  `names` are the constants of its module; `constant` names constant bytes; `calls` are the
    routines that it calls, known after `translate`."""

    def __init__(self, function: ast.FunctionDef, names: Mapping[str, Any], constant: Callable[[bytes], str]) -> None:
        self.function, self.names, self.constant = function, names, constant
        self.calls: set[str] = set()
        self.lines: list[str] = []
        self.variables: dict[str, None] = {}
        self.loops: list[tuple[str, str]] = []
        self.dead = False
        self._count = 0

    def translate(self) -> list[str]:
        """The lines of the function."""
        arguments = [argument.arg for argument in self.function.args.args]
        self.variables.update(dict.fromkeys(arguments))
        self.block(self.function.body)
        if not self.dead:
            self.lines.append("ret i64 0")
        head = f"define i64 @{self.function.name}({', '.join(f'i64 %a.{name}' for name in arguments)}) #1 {{"
        start = [f"%{name} = alloca i64" for name in self.variables]
        start += [f"store i64 %a.{name}, ptr %{name}" for name in arguments]
        return [head, *start, *self.lines, "}"]

    def new(self, text: str) -> str:
        self._count += 1
        self.lines.append(f"%.{self._count} = {text}")
        return f"%.{self._count}"

    def label(self) -> str:
        self._count += 1
        return f"L{self._count}"

    def begin(self, label: str) -> None:
        self.lines.append(f"{label}:")
        self.dead = False

    def jump(self, label: str) -> None:
        if not self.dead:
            self.lines.append(f"br label %{label}")
        self.dead = True

    # --- statements

    def block(self, statements: list[ast.stmt]) -> None:
        for node in statements:
            if not self.dead:
                self.statement(node)

    def statement(self, node: ast.stmt) -> None:
        if isinstance(node, ast.Assign | ast.AugAssign):
            target = node.target if isinstance(node, ast.AugAssign) else node.targets[0]
            assert isinstance(target, ast.Name)
            value = node.value
            if isinstance(node, ast.AugAssign):
                value = ast.BinOp(ast.Name(target.id, ast.Load()), node.op, value)
            number = self.value(value)
            self.variables[target.id] = None
            self.lines.append(f"store i64 {number}, ptr %{target.id}")
        elif isinstance(node, ast.Return):
            self.lines.append(f"ret i64 {self.value(node.value) if node.value else 0}")
            self.dead = True
        elif isinstance(node, ast.If):
            yes, no, after = self.label(), self.label(), self.label()
            self.condition(node.test, yes, no)
            for label, body in ((yes, node.body), (no, node.orelse)):
                self.begin(label)
                self.block(body)
                self.jump(after)
            self.begin(after)
        elif isinstance(node, ast.While):
            self.loop(node)
        elif isinstance(node, ast.Break | ast.Continue):
            self.jump(self.loops[-1][isinstance(node, ast.Break)])
        elif isinstance(node, ast.Expr) and not isinstance(node.value, ast.Constant):
            self.value(node.value)

    def loop(self, node: ast.While) -> None:
        start, body, after = self.label(), self.label(), self.label()
        self.jump(start)
        self.begin(start)
        self.condition(node.test, body, after)
        self.loops.append((start, after))
        self.begin(body)
        self.block(node.body)
        self.jump(start)
        self.loops.pop()
        self.begin(after)

    # --- expressions

    def condition(self, node: ast.expr, yes: str, no: str) -> None:
        """Writes a branch to one of two labels."""
        if isinstance(node, ast.BoolOp):
            for value in node.values[:-1]:
                more = self.label()
                self.condition(value, *((more, no) if isinstance(node.op, ast.And) else (yes, more)))
                self.begin(more)
            self.condition(node.values[-1], yes, no)
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            self.condition(node.operand, no, yes)
        else:
            test = self.comparison(node) if isinstance(node, ast.Compare) else self.new(f"icmp ne i64 {self.value(node)}, 0")
            self.lines.append(f"br i1 {test}, label %{yes}, label %{no}")
            self.dead = True

    def comparison(self, node: ast.Compare) -> str:
        numbers = [self.value(operand) for operand in (node.left, *node.comparators)]
        tests = [self.new(f"icmp {_SIGNS[type(sign)]} i64 {left}, {right}")
                 for sign, left, right in zip(node.ops, numbers, numbers[1:], strict=False)]
        while len(tests) > 1:
            tests[:2] = [self.new(f"and i1 {tests[0]}, {tests[1]}")]
        return tests[0]

    def value(self, node: ast.expr) -> str:
        if isinstance(node, ast.Constant):
            assert isinstance(node.value, int)
            return str(int(node.value))
        if isinstance(node, ast.Name):
            if node.id in self.variables:
                return self.new(f"load i64, ptr %{node.id}")
            return str(int(self.names[node.id]))
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            return self.new(f"sub i64 0, {self.value(node.operand)}")
        if isinstance(node, ast.BinOp):
            left, right = self.value(node.left), self.value(node.right)
            return self.new(f"{_SIGNS[type(node.op)]} i64 {left}, {right}")
        if isinstance(node, ast.Compare):
            return self.new(f"zext i1 {self.comparison(node)} to i64")
        assert isinstance(node, ast.Call) and isinstance(node.func, ast.Name), ast.dump(node)
        return self.call(node.func.id, node.args)

    def call(self, name: str, operands: list[ast.expr]) -> str:
        if name == "ord":
            assert isinstance(operands[0], ast.Constant) and isinstance(operands[0].value, str)
            return str(ord(operands[0].value))
        if name == "data":
            content = operands[0]
            value = content.value if isinstance(content, ast.Constant) else self.names[ast.unparse(content)]
            assert isinstance(value, bytes)
            return self.new(f"ptrtoint ptr {self.constant(value)} to i64")
        numbers = [self.value(operand) for operand in operands]
        if name not in _INLINE:
            self.calls.add(name)
            return self.new(f"call i64 @{name}({', '.join(f'i64 {number}' for number in numbers)})")
        self._count += 1
        unique = f"%.{self._count}"
        self.lines += [line.format(*numbers, u=unique) for line in _INLINE[name]]
        return f"{unique}r"
