"""The pages of the Python interface: the public names of each module, and what their docstrings say."""

from __future__ import annotations

import ast
import inspect
import re
from importlib import import_module
from typing import TYPE_CHECKING, Any

import fbvm
from product_pages.markdown import HOUSE, code, fence, page, table

if TYPE_CHECKING:
    from docutils.nodes import Node
    from sphinx.application import Sphinx

FOLDER = "reference/python"
SUBJECTS = {
    "Compile": ("compile_files", "compile_sources", "compile_text", "Compilation", "Diagnostic", "Source", "Image"),
    "Run": ("Plc", "Mode", "Trap", "Stopped", "UnknownPlace"),
    "Units": ("Etn21", "Noc", "OpenPlc", "Tianxing"),
    "Networks and peers": ("LoopNetwork", "TcpNetwork", "Peer", "ModbusPeer", "ModbusServer"),
    "Look": ("chart", "draw", "Recorder", "Recording", "TraceWriter", "Depth", "Trace", "Capture"),
    "Recordings in files": ("RecordingFile", "FileScans", "RecordingWriter"),
    "Journals": ("Journal", "JournalError", "open_journal", "Replay"),
    "PLCopen XML": ("import_xml", "Imported", "export_xml", "Exported"),
}
"""The public names of `fbvm`, by what they are for."""
MODULES: dict[str, tuple[str, ...]] = {
    "fbvm.run": (),
    "fbvm.testing": (),
    "fbvm.testing.strategies": ("inputs", "values", "delays", "courses", "follow"),
    "fbvm.testing.machine": ("block_machine", "faults"),
    "fbvm.machine.breakpoints": ("Breakpoints", "Breakpoint", "Halt", "Frame"),
    "fbvm.net.faults": ("Fault", "random_faults"),
    "fbvm.net.misdeeds": ("RudePeer", "by_script", "by_seed"),
    "fbvm.wire.link": ("Network", "Link", "Connect", "Listen", "Bind", "Send", "SendTo", "Grant", "Close", "Opened", "Failed",
                       "Sent", "Received", "PeerClosed", "Broken", "Closed"),
    "fbvm.units.contract": ("Unit", "AreaMemory"),
}  # fmt: skip
"""Other modules with names for users; without names those of `__all__`."""
PLUGIN = HOUSE / "fbvm/testing"
"""Where the modules of the pytest plugin are."""


def pages() -> dict[str, str]:
    """The list of modules, and the page of each."""
    listed = {name for names in SUBJECTS.values() for name in names}
    assert listed == set(fbvm.__all__) - {"__version__"}, "a public name of fbvm has no subject"
    made = {f"{FOLDER}/index": _index(), f"{FOLDER}/fbvm": _front(), f"{FOLDER}/pytest": _plugin()}
    return made | {f"{FOLDER}/{module}": _module(module) for module in MODULES}


def _index() -> str:
    modules = ["fbvm", *MODULES]
    rows = [(f"[{code(name)}]({name}.md)", _first_line(name)) for name in modules]
    listed = "\n".join([*modules, "pytest"])
    return page(
        "# Python",
        "All of fbvm is a Python package, and the command line uses nothing that is not in it. Names are loaded when they are "
        "asked for, so `import fbvm` is quick. Times are integers of nanoseconds, and the names of variables and parameters that "
        "hold one end in `_ns`. What a program, a file or a peer does wrong is told by diagnostics, traps and events; exceptions "
        "are raised for wrong use only, and each entry names them.",
        table(("module", ""), [*rows, ("[pytest](pytest.md)", "Fixtures, options and settings of the pytest plugin.")]),
        f"```{{toctree}}\n:hidden:\n\n{listed}\n```")  # fmt: skip


def _first_line(module: str) -> str:
    return (inspect.getdoc(import_module(module)) or "").partition("\n\n")[0].replace("\n", " ")


def _front() -> str:
    head, _, example = (inspect.getdoc(fbvm) or "").partition("\n\n")
    example, _, rest = example.partition("\n\n")
    parts = ["# fbvm", head, fence(inspect.cleandoc(example), "python"), rest]
    for subject, names in SUBJECTS.items():
        parts += [f"## {subject}", *(_entry("fbvm", name) for name in names)]
    return page(*parts)


def _module(name: str) -> str:
    module: Any = import_module(name)
    said = inspect.getdoc(module) or ""
    return page(f"# {name}", said, *(_entry(name, public) for public in MODULES[name] or module.__all__))


def _entry(module: str, name: str) -> str:
    """The directive that puts a name, its signature, its docstring and its members on the page."""
    thing = getattr(import_module(module), name)
    if not inspect.isclass(thing):
        kind, options = "autofunction" if callable(thing) else "autodata", ""
    elif issubclass(thing, BaseException):
        kind, options = "autoexception", ""
    else:
        kind, options = "autoclass", "\n   :members:"
    return f"```{{eval-rst}}\n.. {kind}:: {module}.{name}{options}\n```"


def _plugin() -> str:
    """Fixtures by their docstrings, and options and settings as pytest is given them."""
    trees = [ast.parse(path.read_text(encoding="utf-8")) for path in sorted(PLUGIN.rglob("*.py"))]
    functions = [node for tree in trees for node in tree.body if isinstance(node, ast.FunctionDef) and node.name[0] != "_"]
    fixtures = [node for node in functions if any("fixture" in ast.unparse(mark) for mark in node.decorator_list)]
    calls = [node for tree in trees for node in ast.walk(tree) if isinstance(node, ast.Call)]
    return page(
        "# pytest", "The plugin is loaded wherever fbvm is installed.",
        *(f"## Fixture `{node.name}`\n\n{ast.get_docstring(node)}" for node in fixtures),
        "## Options", table(("option", ""), _options(calls, "addoption")),
        "## Settings", "In `[tool.pytest.ini_options]` of `pyproject.toml`, or in `pytest.ini`.",
        table(("setting", ""), _options(calls, "addini")))  # fmt: skip


def _options(calls: list[ast.Call], method: str) -> list[tuple[str, str]]:
    rows = []
    for call in calls:
        if isinstance(call.func, ast.Attribute) and call.func.attr == method:
            given = {word.arg: ast.unparse(word.value) for word in call.keywords}
            name = ast.literal_eval(call.args[0])
            said = given["help"] if method == "addoption" else ast.unparse(call.args[1])
            metavar = f" {ast.literal_eval(given['metavar'])}" if "metavar" in given else ""
            rows.append((code(name + metavar), re.sub(r" \(default: .*?\)", "", said.removeprefix("f")[1:-1])))
    return sorted(rows)


# --- docstrings, as Sphinx wants them ---------------------------------------------------------------------------------


def connect(app: Sphinx) -> None:
    """Let Sphinx read docstrings as they are written here, and leave names of types alone that have no page."""
    app.connect("autodoc-process-docstring", lambda app, what, name, thing, options, lines: reshape(lines))
    app.connect("missing-reference", _plain_name)


def _plain_name(app: Sphinx, env: object, node: Any, shown: Node) -> Node | None:
    """What stands for a reference to a name of Python that no page describes: the name itself."""
    return shown if node.get("refdomain") == "py" else None


def reshape(lines: list[str]) -> None:
    """Turn a docstring into reStructuredText in place: code between single backquotes, and indented blocks as code."""
    made: list[str] = []
    in_block = False
    for line in lines:
        indented = line.startswith("    ")
        begins = indented and not in_block and bool(made) and not made[-1]
        in_block = indented or in_block and not line
        if begins:
            made += [".. code-block:: none", ""]
        made.append(line if in_block or line.startswith(">>>") else _inline(line))
    lines[:] = made


def _inline(line: str) -> str:
    """Code between two backquotes on each side; marks of reStructuredText elsewhere mean themselves."""
    parts = re.split(r"(`+[^`]+`+)", line)
    return "".join(f"``{part.strip('`')}``" if part.startswith("`") else re.sub(r"([*|])", r"\\\1", part) for part in parts)
