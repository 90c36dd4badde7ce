"""The rules of the house: floors, what must stay absent, sizes, and that every table row has its page and its test."""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import pytest
from house import (
    HOUSE,
    MODULES,
    PACKAGE,
    branches,
    circles,
    dotted,
    folder_of,
    functions,
    imports,
    most_branches,
    name_of,
    room_of,
    statements,
    text_of,
    tree,
)

from fbvm.base.codes import CODES
from fbvm.base.dialects import DIALECTS
from fbvm.code.operations import EXPRESSIONS, STATEMENTS

LONGEST_FILE, LONGEST_FUNCTION = 450, 60

MOST_BRANCHES = 20
"""Cyclomatic complexity of a function."""
MOST_FILES = 22
"""Modules that one folder may hold, beside `__init__.py`."""

FLOORS = {
    "base": 0,
    "syntax": 1, "wire": 1,
    "check": 2, "interchange": 2, "net": 2,
    "code": 3,
    "engine": 4, "watch": 4, "analysis": 4,
    "processor": 5, "units": 5, "machine": 5,
    "record": 6, "step": 6, "run": 6,
    "testing": 7, "live": 7, "dap": 7, "lsp": 7, "prove": 7, "campaign": 7,
    "cli": 8, "": 8, "__main__": 8,
}  # fmt: skip
"""A room may import from its own floor and from below.  Rooms without a folder yet have their place already."""
ORDERS = {
    "syntax": ("tree", "st", "ladder/instructions", "ladder/drawing", "ladder", "il", "sfc", "recovery", "", "formatter"),
    "check": ("symbols", "expressions", "calls", "declarations", "lint", ""),
    "interchange": ("", "cx", "cx/read", "cx/write", "plcopen", "plcopen/read", "plcopen/write", "twincat", "codesys2",
                    "formats"),
    "code": ("", "builder", "layout", "pictures", "lowering", "store", "compiler"),
    "engine": ("", "python", "native/llvm", "native/library", "native/emit", "native/scans", "native", "choice"),
    "wire": ("", "fins"),
    "units": ("", "etn21/fins", "etn21", "port", "openplc"),
    "machine": ("scan", "servicing", "fast", ""),
    "prove": ("encoding", ""),
    "campaign": ("", "mutation", "items", "fleet"),
    "testing": ("", "course", "suites"),
    "record": ("trace", "recording", "draw", "export", "page"),
    "cli": ("shared", "shared/debug", "shared/live", "programs", "running", "recordings", "projects", "editors", ""),
}
"""The folders of a room, the lowest first; "" is the room itself.  A folder imports from those before it."""
_VERBS = ORDERS["cli"][3:-1]
UNRELATED = {("syntax/ladder/drawing", "syntax/st"), ("syntax/sfc", "syntax/ladder"), ("syntax/recovery", "syntax/ladder"),
             ("syntax/recovery", "syntax/sfc"), ("interchange/plcopen/write", "interchange/plcopen/read"),
             ("units/port", "units/etn21"), *((f"cli/{one}", f"cli/{other}") for one in _VERBS for other in _VERBS)}  # fmt: skip
"""A folder, and another one before it that it does not import all the same."""
ANYWHERE = {"fbvm.syntax.text"}
"""Modules that import nothing of their room."""
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
            ("analysis", "engine"), ("run", "record"), ("record", "run"), ("check", "interchange"), ("code", "interchange"),
            *((one, other) for one in SHOPS for other in SHOPS - {one} if (one, other) not in BETWEEN_SHOPS)}  # fmt: skip
"""Neighbours that do not import each other."""
ONLY_IN = {
    "socket": {"net/tcp.py", "net/connections.py", "net/udp.py", "net/streams.py", "live/sockets.py"},
    "selectors": {"net", "base/host.py", "live/sockets.py"},
    "websockets": {"live"},
    "time": {"run", "base/host.py"},
    "threading": {"code/recursion.py", "engine/native/code.py", "engine/native/llvm/worker.py", "dap", "cli/shared/ending.py"},
    "subprocess": {"base/children.py", "engine/apart.py", "engine/native/llvm/worker.py", "cli", "campaign", "testing"},
    "llvmlite": {"engine/native/llvm/compiler.py"},
    "bitwuzla": {"prove/solver.py"},
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
SYSTEM_MODULES = {"fcntl", "grp", "msvcrt", "platform", "posix", "pwd", "resource", "termios", "winreg", "winsound", "_winapi"}
SYSTEM_NAMES = {
    "sys": {"platform", "getwindowsversion"},
    "os": {"name", "uname", "replace", "rename", "link", "symlink", "chmod", "chown", "fchmod", "umask", "getuid", "geteuid",
           "kill", "killpg", "fork", "O_NONBLOCK", "O_BINARY", "O_NOFOLLOW", "set_blocking"},
    "time": {"CLOCK_MONOTONIC", "clock_gettime", "clock_gettime_ns"},
    "select": {"epoll", "poll", "kqueue"},
    "selectors": {"EpollSelector", "KqueueSelector", "SelectSelector"},
    "mmap": {"MAP_PRIVATE", "MAP_ANONYMOUS"},
    "signal": {"SIGTERM", "SIGHUP", "SIGUSR1", "SIGUSR2", "SIGBREAK", "SIGALRM", "SIGPIPE", "signal", "setitimer",
               "pthread_sigmask"},
}  # fmt: skip
"""Names of Python's library that only some systems have, or that mean something else on each."""
MENTIONED = re.compile(
    "|".join(
        [
            r"\b(?:hasattr|getattr)\(",
            *(rf"\b{module}\.(?:{'|'.join(names)})\b|\bfrom {module} " for module, names in SYSTEM_NAMES.items()),
        ]
    )
)
"""What stands in the text of a module that may use one of these names: a search is quicker than a walk through the tree."""
HOST = "base/host.py"
SYSTEM_ELSEWHERE = {
    "run/interrupts.py": {"signal.signal"},  # delays Ctrl-C, which every system has, in the loop that it belongs to
}
"""What stands outside of `base/host.py` all the same, and why."""
VENDORS = {*DIALECTS, "schneider", "tianxing", "twincat"} - {"standard"}
NAMED = re.compile("|".join(map(re.escape, VENDORS)), re.I)
DATES = {"datetime", "date", "datetime.datetime", "datetime.date"}


@pytest.fixture(autouse=True, scope="module")
def _let_go() -> Iterator[None]:
    """A million nodes that no other test wants."""
    yield
    for known in (text_of, tree, statements, imports):
        known.cache_clear()


def climbing(path: Path) -> list[str]:
    """What a module imports from above, from the other stair or from a neighbour it does not know."""
    room = room_of(dotted(path))
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
    long = [node.name for node in functions(path) if (node.end_lineno or 0) - node.lineno + 1 > LONGEST_FUNCTION]
    lines = len(text_of(path).splitlines())
    return long + [f"{lines} lines"] * (lines > LONGEST_FILE)


def dates(path: Path) -> list[str]:
    if not re.search(r"\.(now|utcnow|today)\b", text_of(path)):
        return []
    return [node.attr for node in ast.walk(tree(path)) if isinstance(node, ast.Attribute)
            and node.attr in ("now", "utcnow", "today") and ast.unparse(node.value) in DATES]  # fmt: skip


def leftovers(path: Path) -> list[str]:
    text = text_of(path)
    return [*re.findall(r"util|helper|manager|handler", path.stem),
            *re.findall(r"\b(?:TODO|FIXME|XXX|HACK)\b|NotImplementedError", text)]  # fmt: skip


def wrong(rule: Callable[[Path], list[str]]) -> dict[str, list[str]]:
    """The modules that break a rule, each with what it has of it."""
    return {name_of(path): found for path in MODULES if (found := rule(path))}


def test_imports_never_climb() -> None:
    assert wrong(climbing) == {}


def test_no_modules_import_one_another() -> None:
    """Nor round about, nor for types alone, nor inside functions."""
    graph = {dotted(path): {name for name in imports(path) if name.split(".")[0] == "fbvm"} - {dotted(path)} for path in MODULES}
    assert circles(graph) == [], "what all of them need belongs into a module below them; what ties them together, into one above"


def place_of(folder: str) -> int:
    """Where a folder stands in the order of its room."""
    room, _, rest = folder.partition("/")
    return ORDERS[room].index(rest) if room in ORDERS else 0


def below_out_of_order(path: Path) -> list[str]:
    """What a module imports from folders of its room that stand behind its own."""
    here = folder_of(dotted(path))
    others = [name for name in imports(path) if room_of(name) == room_of(dotted(path)) and name not in ANYWHERE | {"fbvm"}]
    return [name for name in others if (there := folder_of(name)) != here
            and (place_of(there) > place_of(here) or (here, there) in UNRELATED)]  # fmt: skip


def test_folders_of_a_room_import_those_before_them() -> None:
    assert wrong(below_out_of_order) == {}


def test_every_folder_has_its_place_in_the_order() -> None:
    folders = {folder_of(dotted(path)) for path in MODULES if path.name != "__init__.py"}
    inner = {folder.partition("/")[0] for folder in folders if "/" in folder}
    assert {folder for folder in folders if folder.partition("/")[0] in inner} == {
        f"{room}/{folder}".rstrip("/") for room, order in ORDERS.items() for folder in order}


TOPS = {"fbvm.check.checker"}
PARTS = {"fbvm.check.calls.calls": TOPS | {"fbvm.check.statements"}, "fbvm.check.declarations.interfaces": TOPS,
         "fbvm.check.declarations.globals": TOPS, "fbvm.check.expressions.rules": TOPS}  # fmt: skip
"""Rules of the check, and who in `check/` puts them together."""


def test_only_the_checker_puts_the_rules_of_the_check_together() -> None:
    modules = [path for path in MODULES if room_of(dotted(path)) == "check"]
    assert {part: {dotted(path) for path in modules if part in imports(path)} for part in PARTS} == PARTS


def too_many_ways(path: Path) -> list[str]:
    lines = text_of(path).splitlines()
    return [f"{function.name}: {ways}" for function in functions(path)
            if most_branches(function, lines) > MOST_BRANCHES and (ways := branches(function)) > MOST_BRANCHES]  # fmt: skip


def test_the_ways_through_a_function_can_be_followed() -> None:
    assert wrong(too_many_ways) == {}, "make a table of what differs, or a function of each kind of case"


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


def of_systems(path: Path) -> list[str]:
    """The names of Python's library with which a module asks or uses what differs by operating system."""
    if name_of(path) == HOST:
        return []
    found = [name for name in imports(path) if name.split(".")[0] in SYSTEM_MODULES]
    for node in ast.walk(tree(path)) if MENTIONED.search(text_of(path)) else ():
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            if node.attr in SYSTEM_NAMES.get(node.value.id, ()):
                found.append(f"{node.value.id}.{node.attr}")
        elif isinstance(node, ast.ImportFrom):
            found += [f"{node.module}.{each.name}" for each in node.names if each.name in SYSTEM_NAMES.get(node.module or "", ())]
        elif isinstance(node, ast.Call) and ast.unparse(node.func) in ("hasattr", "getattr") and len(node.args) > 1:
            asked, name = node.args[:2]
            if isinstance(name, ast.Constant) and ast.unparse(asked) in {*SYSTEM_NAMES, "socket", "stat", "ctypes", "errno"}:
                found.append(f"{ast.unparse(asked)}.{name.value}")
    return sorted(set(found) - SYSTEM_ELSEWHERE.get(name_of(path), set()))


def test_what_differs_by_operating_system_stands_in_one_module() -> None:
    assert wrong(of_systems) == {}


def written_in_place(path: Path) -> list[str]:
    """The calls with which a module writes into a file that is there under its name before it is whole."""
    if name_of(path) == "base/files.py" or not re.search(r"\bwrite_(text|bytes)\b", text_of(path)):
        return []
    return [node.func.attr for node in ast.walk(tree(path)) if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
            and node.func.attr in ("write_text", "write_bytes")]  # fmt: skip


def test_files_are_written_beside_and_put_in_place_whole() -> None:
    assert wrong(written_in_place) == {"testing/course/lessons.py": ["write_text"]}, "write_file of base/files.py does it"


def resolving(path: Path) -> list[str]:
    """The paths that a module resolves by itself: `Path.resolve` ends in a RuntimeError at links that lead to one another."""
    if name_of(path) in ("base/files.py", "base/data.py") or "resolve()" not in text_of(path):
        return []
    return [ast.unparse(node) for node in ast.walk(tree(path)) if isinstance(node, ast.Call) and not node.args
            and isinstance(node.func, ast.Attribute) and node.func.attr == "resolve"]  # fmt: skip


def test_links_are_followed_by_one_function() -> None:
    of_declarations = {"check/checker.py": ["self.var_config.resolve()"],
                       "check/declarations/interfaces.py": ["_Interface(context, pou).resolve()"]}  # fmt: skip
    assert wrong(resolving) == of_declarations, "resolved of base/files.py does it"


def vendors(path: Path) -> list[str]:
    """The vendors and dialects with whose names a module of the compiler or the engines compares anything."""
    if path.relative_to(PACKAGE).parts[0] not in STAIRS["language"] or not NAMED.search(text_of(path)):
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


def test_files_that_the_architecture_names_are_there() -> None:
    named = re.findall(r"`((?:[\w.]+/)+[\w.]*)`", (HOUSE / "ARCHITECTURE.md").read_text(encoding="utf-8"))
    roots = [HOUSE, PACKAGE, *(PACKAGE / room for room in ORDERS)]
    assert len(named) > 50
    assert [name for name in named if not any((root / name).exists() for root in roots)] == []


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
    text = "\n".join(text_of(path) for path in MODULES if path.name != "codes.py")
    assert [code for code in CODES if f'"{code}"' not in text] == [], "nothing reports these"


# --- operations -------------------------------------------------------------------------------------------------------


def test_every_operation_is_exercised() -> None:
    named = set(re.findall(r"""["'](\w+)["']""", all_tests()))
    assert [name for name in [*EXPRESSIONS, *STATEMENTS] if name not in named] == []


def test_no_two_test_files_have_the_same_name() -> None:
    """pytest imports each under the name of its file alone."""
    names = Counter(path.name for path in (PACKAGE.parent / "tests").rglob("test_*.py"))
    assert [name for name, count in names.items() if count > 1] == []
