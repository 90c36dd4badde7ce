"""LLVM, by way of llvmlite: module text becomes an object, an object becomes addresses of functions.

The one place that imports llvmlite, and only when asked; everything works without it but this."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.util import find_spec
from itertools import count
from typing import Any

MATH = {"ln": 1, "log": 1, "exp": 1, "sin": 1, "cos": 1, "tan": 1, "asin": 1, "acos": 1, "atan": 1, "pow": 2, "atan2": 2}
"""Functions of doubles that objects call, by their names in the table of operations, and how many they take."""
_NUMBERS = count(1)
_LIBRARIES = {"linux": "libm.so.6", "win32": "ucrtbase"}
"""Where the functions of C's math.h are that Python's `math` calls; elsewhere they come with the process."""
_NAMES = {"ln": "log", "log": "log10"}
FAULTS = {
    "-disable-loop-idiom-hashrecognize": (22,),  # 22.1.0: a CRC loop whose counter is used afterwards has a wrong counter
}
"""Options that switch off what LLVM is known to do wrongly, and since which of its versions they are understood."""
_PYTHON = {"double_to_string": "PyOS_double_to_string", "string_to_double": "PyOS_string_to_double",
           "free": "PyMem_Free"}
"""What texts of floats need, so that they are the very texts that Python writes: functions of the interpreter written
in C, which are called with its lock held."""


@cache
def available() -> bool:
    """True if llvmlite is installed."""
    return find_spec("llvmlite") is not None


@cache
def llvm() -> Any:
    """`llvmlite.binding`, ready for this machine, with our symbols.  Raises ImportError where there is none."""
    import llvmlite.binding as binding  # type: ignore[import-untyped]

    if binding.llvm_version_info < (20,):  # there it is to be done by hand, and not allowed later
        binding.initialize()
    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    for option, first in FAULTS.items():
        if binding.llvm_version_info >= first:
            binding.set_option("fbvm", option)
    return binding


@cache
def _symbols() -> dict[str, int]:
    """Functions that objects call, by the names that modules give them."""
    try:
        library = ctypes.CDLL(_LIBRARIES.get(sys.platform))
    except OSError:
        library = ctypes.CDLL(None)
    found = {name: getattr(library, _NAMES.get(name, name)) for name in MATH}
    found |= {name: getattr(ctypes.pythonapi, function) for name, function in _PYTHON.items()}
    return {f"fbvm_{name}": _address(function) for name, function in found.items()}


def _address(function: Any) -> int:
    address = ctypes.cast(function, ctypes.c_void_p).value
    assert address is not None
    return address


@cache
def host() -> tuple[str, str, str, str]:
    """What an object depends on besides its module: version of llvmlite, triple, processor, its features."""
    import llvmlite

    binding = llvm()
    return (llvmlite.__version__, binding.get_process_triple(), binding.get_host_cpu_name(),
            binding.get_host_cpu_features().flatten())


@cache
def _machine(level: int) -> Any:
    return _fresh_machine(level)


def _fresh_machine(level: int) -> Any:
    """A target machine: the host, no excess precision, no contraction of a product and a sum."""
    _, triple, processor, features = host()
    return llvm().Target.from_triple(triple).create_target_machine(
        cpu=processor, features=features, opt=2 if level else 0, reloc="pic", codemodel="small")


def compile_text(text: str, level: int) -> bytes:
    """The object of a module: at level 0 soon, at level 2 fast; at level 1 of good instructions for what is written well,
    without the passes over the module, which take ten times as long to load as a small module needs.

    Raises RuntimeError for a text that is no module."""
    machine = _machine(level)
    module = _optimised(text, level)
    emitted: bytes = machine.emit_object(module)
    return emitted


def _optimised(text: str, level: int) -> Any:
    """The module of a text after the passes of a level; only level 2 has any."""
    binding = llvm()
    module = binding.parse_assembly(text, binding.create_context())
    module.triple = host()[1]
    module.data_layout = str(_machine(level).target_data)
    if level < 2:
        return module
    options = binding.create_pipeline_tuning_options(speed_level=level)
    options.loop_vectorization = options.slp_vectorization = True
    builder = binding.create_pass_builder(_machine(level), options)
    builder.getModulePassManager().run(module, builder)
    return module


def assembly(text: str, level: int) -> tuple[str, str]:
    """A module after optimisation, and the processor's instructions: for those who want to look."""
    module = _optimised(text, level)
    return str(module), _machine(level).emit_assembly(module)


@cache
def _jit() -> Any:
    """What loads objects; their sections lie together, as small code wants them."""
    return llvm().create_lljit_compiler(_fresh_machine(2), use_jit_link=sys.platform != "win32")


class Linked:
    """An object in memory, ready to be called.  It stays as long as somebody has this.

    `exports` are the functions and variables whose addresses are wanted, `others` functions that it may call besides
    those of the host.  Raises RuntimeError for a damaged object."""

    def __init__(self, compiled: bytes, exports: Iterable[str], others: Mapping[str, int] | None = None) -> None:
        builder = llvm().JITLibraryBuilder().add_object_img(compiled).add_current_process()
        for name, address in (_symbols() | dict(others or {})).items():
            builder.import_symbol(name, address)
        for name in exports:
            builder.export_symbol(name)
        self._library = builder.link(_jit(), f"fbvm{next(_NUMBERS)}")

    def address(self, name: str) -> int:
        """Where one of the exports is.  Raises KeyError for another name."""
        address: int = self._library[name]
        return address
