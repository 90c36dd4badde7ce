"""LLVM, by way of llvmlite: compiles the text of a module to an object file, and loads object files.

The only module that imports llvmlite, and only when something is to be compiled or loaded."""

from __future__ import annotations

import ctypes
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.util import find_spec
from itertools import count
from typing import Any

from fbvm.base.host import links_in_place, math_library

MATH = {"ln": 1, "log": 1, "exp": 1, "sin": 1, "cos": 1, "tan": 1, "asin": 1, "acos": 1, "atan": 1, "pow": 2, "atan2": 2}
"""Functions of doubles that machine code calls, by their names in the table of operations, and how many arguments they take."""
_NUMBERS = count(1)
_NAMES = {"ln": "log", "log": "log10"}
FAULTS = {
    "-disable-loop-idiom-hashrecognize": (22,),  # 22.1.0: a CRC loop whose counter is used afterwards has a wrong counter
}
"""Options that switch off passes of LLVM with known faults, and the first version that knows each option."""
TUNING = {"znver": ",+slow-shld"}
"""What LLVM is told of processors whose names begin so, beside their features: AMD's take a shift across two registers apart
into six operations, which LLVM 22 does not know of the newest; two shifts and an OR are faster."""
_PYTHON = {"double_to_string": "PyOS_double_to_string", "string_to_double": "PyOS_string_to_double",
           "free": "PyMem_Free"}
"""Functions of the interpreter by which machine code writes and reads floats, so that the texts are those of the Python engine.
They are called with the interpreter's lock held."""


@cache
def available() -> bool:
    """True if llvmlite is installed."""
    return find_spec("llvmlite") is not None


@cache
def llvm() -> Any:
    """The module `llvmlite.binding`, initialised for this machine.  Raises ImportError where llvmlite is missing."""
    import llvmlite.binding as binding  # type: ignore[import-untyped]

    if binding.llvm_version_info < (20,):  # there it is to be done by hand, and not allowed later
        binding.initialize()
    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    for option, first in FAULTS.items():
        if binding.llvm_version_info >= first:
            binding.set_option("fbvm", option)
    return binding


SEARCHED = 30
"""Instructions of a block among which LLVM looks for the store that a load reads, where 100 are its default: in a module of 2.6
million characters that takes a third of all the time, and without it the code is 5 % smaller and as fast.  Small modules get
faster code with it."""


@cache
def search_less() -> None:
    """Has this process compile large modules in two thirds of the time; for one that compiles these only."""
    llvm().set_option("fbvm", f"-memdep-block-scan-limit={SEARCHED}")


@cache
def _symbols() -> dict[str, int]:
    """The addresses of the functions outside that machine code calls, by the names that modules give them."""
    try:
        library = ctypes.CDLL(math_library())
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
    """What an object depends on besides its module: version of llvmlite, target triple, processor, features of the processor."""
    import llvmlite

    binding = llvm()
    processor: str = binding.get_host_cpu_name()
    features = binding.get_host_cpu_features().flatten() + tuning(processor)
    return llvmlite.__version__, binding.get_process_triple(), processor, features


def tuning(processor: str) -> str:
    """What stands of a processor in `TUNING`, to be appended to its features; "" for most."""
    return next((more for name, more in TUNING.items() if processor.startswith(name)), "")


@cache
def _machine(level: int) -> Any:
    return _fresh_machine(level)


def _fresh_machine(level: int) -> Any:
    """A target machine for the host, without excess precision and without fused products and sums."""
    _, triple, processor, features = host()
    return llvm().Target.from_triple(triple).create_target_machine(
        cpu=processor, features=features, opt=2 if level else 0, reloc="pic", codemodel="small")


def compile_text(text: str, level: int) -> bytes:
    """Compiles the text of a module.  Returns the object file.

    Level 0 compiles soon, level 2 makes fast code.  Level 1 selects good instructions but runs no passes over the module: for
    small modules of code that is written well, since to load the passes takes ten times as long as to compile such a
    module.  Raises RuntimeError for a text that is no module."""
    machine = _machine(level)
    module = _optimised(text, level)
    emitted: bytes = machine.emit_object(module)
    return emitted


def _optimised(text: str, level: int) -> Any:
    """The module of a text, after the passes of level 2 if that is the level."""
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
    """The module of a text after optimisation, and its assembly, both as text: for inspection."""
    module = _optimised(text, level)
    return str(module), _machine(level).emit_assembly(module)


@cache
def _jit() -> Any:
    """What loads object files.  It places the sections of one close together, as the small code model demands."""
    return llvm().create_lljit_compiler(_fresh_machine(2), use_jit_link=links_in_place())


class Linked:
    """An object file that is loaded.  It stays in memory as long as this Python object.

    `compiled` is the object file, `exports` the functions and variables whose addresses are wanted, `others` the addresses of
    functions that it may call besides those of the host.  Raises RuntimeError for a damaged object file."""

    def __init__(self, compiled: bytes, exports: Iterable[str], others: Mapping[str, int] | None = None) -> None:
        builder = llvm().JITLibraryBuilder().add_object_img(compiled).add_current_process()
        for name, address in (_symbols() | dict(others or {})).items():
            builder.import_symbol(name, address)
        for name in exports:
            builder.export_symbol(name)
        self._library = builder.link(_jit(), f"fbvm{next(_NUMBERS)}")

    def address(self, name: str) -> int:
        """The address of one of the exports.  Raises KeyError for another name."""
        address: int = self._library[name]
        return address
