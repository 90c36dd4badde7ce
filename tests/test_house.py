"""The rules of the house: floors, what must stay absent, sizes, and that every table row has its page and its test."""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import pytest

from fbvm.base.codes import CODES
from fbvm.base.dialects import DIALECTS
from fbvm.code.operations import EXPRESSIONS, STATEMENTS

HOUSE = Path(__file__).resolve().parent.parent
PACKAGE = HOUSE / "fbvm"
LONGEST_FILE, LONGEST_FUNCTION = 450, 60

MOST_FILES = 22
"""Modules that one folder may hold, beside `__init__.py`."""

FLOORS = {
    "base": 0,
    "syntax": 1, "wire": 1,
    "check": 2, "interchange": 2, "net": 2,
    "code": 3,
    "engine": 4, "watch": 4,
    "processor": 5, "units": 5, "machine": 5,
    "record": 6, "step": 6, "run": 6,
    "testing": 7, "live": 7, "dap": 7, "lsp": 7, "prove": 7, "campaign": 7,
    "cli": 8, "": 8, "__main__": 8,
}  # fmt: skip
"""A room may import from its own floor and from below.  Rooms without a folder yet have their place already."""
STAIRS = {
    "language": {"syntax", "check", "interchange", "code", "engine"},
    "machine": {"wire", "units", "net"},
}
"""Neither stairway knows the other; they meet in `machine/`, and in `processor/`, from which a unit that is a program has an
engine."""
SHOPS = {"testing", "live", "dap", "lsp", "prove", "campaign"}
"""Rooms of the top floor but one: what one needs of another is handed in by `cli/`."""
BETWEEN_SHOPS = {("testing", "prove"), ("campaign", "prove"), ("campaign", "testing")}
"""Where one may use the other all the same."""
SEPARATE = {("units", "net"), ("net", "units"), ("units", "engine"), ("engine", "units"), ("watch", "engine"),
            ("run", "record"), ("record", "run"), ("check", "interchange"), ("code", "interchange"),
            *((one, other) for one in SHOPS for other in SHOPS - {one} if (one, other) not in BETWEEN_SHOPS)}  # fmt: skip
"""Neighbours that do not import each other."""
ONLY_IN = {
    "socket": {"net/tcp.py", "net/udp.py"},
    "selectors": {"net"},
    "time": {"run"},
    "threading": {"engine/native/code.py", "engine/native/llvm/worker.py", "run/watchdog.py", "dap"},
    "subprocess": {"engine/native/llvm/worker.py", "cli", "campaign", "testing"},
    "llvmlite": {"engine/native/llvm/compiler.py"},
    "concurrent": {"campaign"},
    "multiprocessing": {"campaign"},
    "_thread": set(),
    "asyncio": {"cli/running/peer.py", "lsp", "campaign/cluster.py"},
    "pymodbus": {"cli/running/peer.py", "cli/running/demo.py"},
    "click": {"cli"},
    "rich": {"cli"},
    "prompt_toolkit": {"cli"},
    "lark": {"syntax"},
}
"""Modules that are used in these places only."""
VENDORS = {*DIALECTS, "schneider", "tianxing", "twincat"} - {"standard"}
DATES = {"datetime", "date", "datetime.datetime", "datetime.date"}


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


MODULES = sorted(PACKAGE.rglob("*.py"))


@pytest.fixture(autouse=True, scope="module")
def _let_go() -> Iterator[None]:
    """A million nodes that no other test wants."""
    yield
    for known in (tree, statements, imports):
        known.cache_clear()


def name_of(path: Path) -> str:
    return path.relative_to(PACKAGE).as_posix()


def room_of(dotted: str) -> str:
    """The room of `fbvm.units.etn21.unit` is "units", that of `fbvm` itself ""."""
    parts = dotted.split(".")
    return parts[1] if len(parts) > 1 else ""


BLOCKS = ("body", "orelse", "finalbody", "handlers", "cases")
"""Where statements hold others."""


@cache
def statements(path: Path) -> list[ast.AST]:
    """All statements of a module, also within functions."""
    found: list[ast.AST] = [tree(path)]
    for node in found:
        found += [inner for block in BLOCKS for inner in getattr(node, block, ())]
    return found


@cache
def imports(path: Path) -> list[str]:
    """Dotted names of all that a module imports, also within functions."""
    found = []
    for node in statements(path):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name_of(path)}: relative import"
            for alias in node.names:
                is_module = (HOUSE / Path(*(node.module or "").split("."), f"{alias.name}.py")).exists()
                is_room = node.module == "fbvm" and (PACKAGE / alias.name).is_dir()
                found.append(f"{node.module}.{alias.name}" if is_module or is_room else node.module or "")
    return found


def climbing(path: Path) -> list[str]:
    """What a module imports from above, from the other stair or from a neighbour it does not know."""
    dotted = ".".join(("fbvm", *path.relative_to(PACKAGE).with_suffix("").parts))
    room = room_of(dotted.removesuffix(".__init__"))
    wrong = []
    for imported in imports(path):
        if imported.split(".")[0] != "fbvm" or (imported == "fbvm" and room == "cli"):
            continue
        other = room_of(imported)
        climbs = FLOORS[other] > FLOORS[room]
        crosses = any(room in stair and other in others for stair in STAIRS.values()
                      for others in STAIRS.values() if stair is not others)  # fmt: skip
        if climbs or crosses or (room, other) in SEPARATE:
            wrong.append(imported)
    return wrong


def out_of_place(path: Path) -> list[str]:
    """What a module imports that is used elsewhere only."""
    here = {name_of(path), path.relative_to(PACKAGE).parts[0]}
    return [name for name in imports(path) if (top := name.split(".")[0]) in ONLY_IN and not here & ONLY_IN[top]]


def too_long(path: Path) -> list[str]:
    long = [node.name for node in statements(path) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
            and (node.end_lineno or 0) - node.lineno + 1 > LONGEST_FUNCTION]  # fmt: skip
    lines = len(path.read_text(encoding="utf-8").splitlines())
    return long + [f"{lines} lines"] * (lines > LONGEST_FILE)


def dates(path: Path) -> list[str]:
    if not re.search(r"\.(now|utcnow|today)\b", path.read_text(encoding="utf-8")):
        return []
    return [node.attr for node in ast.walk(tree(path)) if isinstance(node, ast.Attribute)
            and node.attr in ("now", "utcnow", "today") and ast.unparse(node.value) in DATES]  # fmt: skip


def leftovers(path: Path) -> list[str]:
    text = path.read_text(encoding="utf-8")
    return [*re.findall(r"util|helper|manager|handler", path.stem),
            *re.findall(r"\b(?:TODO|FIXME|XXX|HACK)\b|NotImplementedError", text)]  # fmt: skip


def wrong(rule: Callable[[Path], list[str]]) -> dict[str, list[str]]:
    """The modules that break a rule, each with what it has of it."""
    return {name_of(path): found for path in MODULES if (found := rule(path))}


def test_imports_never_climb() -> None:
    assert wrong(climbing) == {}


def test_every_room_has_a_floor() -> None:
    assert {path.parent.name for path in PACKAGE.glob("*/__init__.py")} <= set(FLOORS)


def test_no_room_is_full() -> None:
    count = Counter(path.parent.relative_to(PACKAGE).as_posix() for path in MODULES if path.name != "__init__.py")
    full = {room: files for room, files in count.items() if files > MOST_FILES}
    assert full == {}, ("a folder with more modules than one keeps in mind: find those that only serve one another, give them a "
                        "folder of their own inside it, and take their common prefix off their names")  # fmt: skip


def test_nothing_stands_at_the_root_of_the_package() -> None:
    assert {path.name for path in PACKAGE.glob("*.py")} == {"__init__.py", "__main__.py"}


def test_no_name_repeats_the_name_of_its_folder() -> None:
    repeated = [name_of(path) for path in MODULES if path.stem.startswith(f"{path.parent.name}_")]
    assert repeated == []


def test_what_must_stay_absent() -> None:
    assert wrong(out_of_place) == {}


def test_files_and_functions_fit_on_a_desk() -> None:
    assert wrong(too_long) == {}


def vendors(path: Path) -> list[str]:
    """The vendors and dialects with whose names a module of the compiler or the engines compares anything."""
    if path.relative_to(PACKAGE).parts[0] not in STAIRS["language"]:
        return []
    return [part.value for node in ast.walk(tree(path)) if isinstance(node, ast.Compare) for part in ast.walk(node)
            if isinstance(part, ast.Constant) and isinstance(part.value, str) and part.value.lower() in VENDORS]  # fmt: skip


def test_nothing_that_compiles_or_executes_asks_for_a_vendor() -> None:
    assert wrong(vendors) == {}


def test_every_module_says_what_it_is_for() -> None:
    assert [name_of(path) for path in MODULES if not ast.get_docstring(tree(path))] == []


def test_nobody_asks_the_clock_for_a_date() -> None:
    assert wrong(dates) == {}


def test_no_room_for_leftovers() -> None:
    assert wrong(leftovers) == {}


def test_fblib_and_grammar_hold_no_python() -> None:
    assert not [*(HOUSE / "fblib").rglob("*.py"), *(HOUSE / "grammar").rglob("*.py")]


# --- diagnostics ------------------------------------------------------------------------------------------------------


@cache
def all_tests() -> str:
    """The text of all tests, and of the programs that they run."""
    paths = [path for ending in ("*.py", "*.st", "*.txt", "*.md") for path in (HOUSE / "tests").rglob(ending)]
    paths = [path for path in paths if path.name != "test_house.py"]
    return "\n".join(path.read_text(encoding="utf-8", errors="replace") for path in paths)


def test_every_code_has_a_page_and_every_page_a_code() -> None:
    assert {path.stem for path in (PACKAGE / "base" / "pages").glob("*.md")} == set(CODES)


def test_every_code_has_a_test() -> None:
    assert [code for code in CODES if code not in all_tests()] == []


def test_every_code_is_used() -> None:
    text = "\n".join(path.read_text(encoding="utf-8") for path in MODULES if path.name != "codes.py")
    assert [code for code in CODES if f'"{code}"' not in text] == [], "nothing reports these"


# --- operations -------------------------------------------------------------------------------------------------------


def test_every_operation_is_exercised() -> None:
    named = set(re.findall(r"""["'](\w+)["']""", all_tests()))
    assert [name for name in [*EXPRESSIONS, *STATEMENTS] if name not in named] == []
