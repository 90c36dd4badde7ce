"""The pytest plugin: fixtures for blocks, programs and networks, failures that explain themselves, tests in ST.

    def test_the_pump_waits(fb):
        pump = fb("src/pump.st::Pump", cycle="10ms")
        pump.run("50ms", Start=True)
        assert pump.Running

Files are looked for beside the test, then in the folders above it, up to that where pytest.ini or pyproject.toml lies.
"""

from __future__ import annotations

import ast
import linecache
import sys
import textwrap
from collections.abc import Generator, Iterable, Mapping, Sequence
from contextlib import ExitStack
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import pytest

from fbvm.base.data import PACKAGE
from fbvm.testing.session import (
    MOST_PAGES,
    count_coverage,
    explains,
    failure_page,
    library_folders,
    project_folder,
    search_folders,
    varied_run,
)
from fbvm.testing.warning_plugin import NAME as WARNINGS
from fbvm.testing.warning_plugin import WarningPlugin, add_options, warning_plugin

if TYPE_CHECKING:
    from fbvm.net.loop import LoopNetwork
    from fbvm.testing.plant_rig import PlantRig
    from fbvm.testing.recorded import Recorded
    from fbvm.testing.rig import Rig
    from fbvm.testing.st_items import StFile
    from fbvm.testing.subject import Stub

RIGS: pytest.StashKey[list[Rig]] = pytest.StashKey()
"""The rigs that a test has made."""


class RigMaker(Protocol):
    """The type of the fixtures `fb` and `plc`: functions that return a rig."""

    def __call__(self, what: str, cycle: str | int = "10ms", *, stubs: Mapping[str, Stub] | None = None,
                 sources: Sequence[str] = (), text: str = "", libraries: Sequence[str] = (), dialect: str = "",
                 **given: Any) -> Rig: ...  # fmt: skip


class Tracer(Protocol):
    """The type of the fixture `trace`."""

    def __call__(self, rig: Rig, *patterns: str, depth: str = "statements") -> Recorded: ...


class PlantMaker(Protocol):
    """The type of the fixture `plant`."""

    def __call__(self, project: str = "fbvm.toml") -> PlantRig: ...


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addini("fbvm_libraries", "folders of libraries of function blocks", type="paths", default=[])
    parser.addini("fbvm_dialect", "whose answers are taken where compilers disagree (fbvm explain dialects)", default="")
    group = parser.getgroup("fbvm", "PLC programs")
    group.addoption("--fbvm-golden", action="store_true", help="write the golden traces of the tests anew")
    group.addoption("--fbvm-pages", type=int, default=MOST_PAGES, metavar="N",
                    help=f"write pages of so many failed tests at most (default: {MOST_PAGES})")  # fmt: skip
    group.addoption("--fbvm-traces", metavar="DIR", help="keep a trace of every test, with every statement")
    group.addoption("--fbvm-cov", action="store_true", help="report which statements and branches of PLC code tests executed")
    group.addoption("--fbvm-cov-html", metavar="DIR", help="write the coverage of PLC code as pages")
    group.addoption("--fbvm-cov-xml", metavar="FILE", help="write the coverage of PLC code as Cobertura XML")
    add_options(parser, group)


def pytest_load_initial_conftests(early_config: pytest.Config) -> None:
    """Projects of TwinCAT are files of tests, too."""
    early_config.pluginmanager.import_plugin("fbvm.testing.suites.plugin")


def pytest_configure(config: pytest.Config) -> None:
    """Warnings are collected; coverage is counted if an option asks for it."""
    config.pluginmanager.register(WarningPlugin(config), WARNINGS)
    if any(config.getoption(name) for name in ("fbvm_cov", "fbvm_cov_html", "fbvm_cov_xml")):
        from fbvm.testing.coverage_plugin import NAME, CoveragePlugin

        config.pluginmanager.register(CoveragePlugin(config), NAME)


@pytest.fixture
def fb(request: pytest.FixtureRequest) -> RigMaker:
    """One function block, function or program on a test rig: `fb("src/pump.st::Pump", cycle="10ms")`, `fb("TON")`.

    `stubs` replace blocks, by name, with ST or a Python function; `text` is ST that is compiled with the file, `sources`
    are further files, `libraries` folders with blocks in files of their names; `dialect` is the dialect of the compiler
    (default: the ini option fbvm_dialect); `etn21` is the IPv4 address of an Ethernet unit, `network` its network, `units`
    are other units."""
    return _maker(request, block=True)


@pytest.fixture
def plc(request: pytest.FixtureRequest) -> RigMaker:
    """A whole program on a test rig: `plc("src/main.st")`, with its tasks; the rest is as for `fb`."""
    return _maker(request, block=False)


@pytest.fixture
def plant(request: pytest.FixtureRequest) -> PlantMaker:
    """The PLCs of a project file, on one network in memory: `plant()` is that of fbvm.toml near the test.

    Each is a rig: `plant().pump.Running`, `made["pump[3]"]`; `run("1s")`, `scan()` and `until("pump.Main.Done", max="5s")` move
    all of them, `made.network` is their network."""
    from fbvm.testing.plant_rig import PlantRig, project_near

    def make(project: str = "fbvm.toml") -> PlantRig:
        __tracebackhide__ = True
        near = project_near(search_folders(request.path, request.config.rootpath), project)
        made = PlantRig(near, varied=varied_run(request.config))
        _rigs(request.node).extend(made.rigs.values())
        for rig in made.rigs.values():
            _instrument(request, rig)
        return made

    return make


@pytest.fixture
def network() -> LoopNetwork:
    """A network in memory and in virtual time, for `fb(..., etn21="192.168.250.21", network=network)`.

    `network.place(Peer(...), ModbusPeer())` puts a server there, `network.faults.append(Fault(...))` a fault."""
    from fbvm.net.loop import LoopNetwork

    return LoopNetwork()


@pytest.fixture
def trace(tmp_path: Path, request: pytest.FixtureRequest) -> Tracer:
    """Looks back at a rig: `run = trace(pump)`, then `run.chart("Start", "Running")`, `run.table(...)`, `run.why("Running")`.

    `run.golden("golden/start.txt", "Running")` compares it with a file beside the test, which `--fbvm-golden` writes.

    `run.path` is a file of it, for `fbvm chart` and `fbvm why`; `trace(pump, "Delay.*", depth="scans")` writes less into it."""
    from fbvm.testing.recorded import Recorded

    numbers = count()

    def record(rig: Rig, *patterns: str, depth: str = "statements") -> Recorded:
        path, anew = tmp_path / f"run{next(numbers)}.fbtrace", request.config.getoption("fbvm_golden")
        return Recorded(rig, path, patterns, depth, request.path.parent, anew)

    return record


def _rigs(node: pytest.Item) -> list[Rig]:
    return node.stash.setdefault(RIGS, [])


def _maker(request: pytest.FixtureRequest, *, block: bool) -> RigMaker:
    rigs = _rigs(request.node)
    folders = search_folders(request.path, request.config.rootpath)

    def make(what: str, cycle: str | int = "10ms", *, libraries: Sequence[str] = (), dialect: str = "", **given: Any) -> Rig:
        from fbvm.testing.rig import Rig

        __tracebackhide__ = True
        own = [folder / path for path in libraries for folder in folders if (folder / path).is_dir()]
        shelves = [*own, *library_folders(request.config, request.path)]
        warnings = warning_plugin(request.config)
        rig = Rig.of(what, cycle, block=block, folders=folders, libraries=shelves, wanted=warnings.wanted,
                     dialect=dialect or request.config.getini("fbvm_dialect"), varied=varied_run(request.config), **given)
        warnings.add(rig.subject)
        rigs.append(rig)
        _instrument(request, rig)
        return rig

    return make


def _instrument(request: pytest.FixtureRequest, rig: Rig) -> None:
    """Attaches coverage and the trace of --fbvm-traces to a rig, as far as they are asked for, until the end of the test."""
    attached = ExitStack()
    attached.enter_context(count_coverage(request.config, rig.plc, rig.subject))
    if folder := request.config.getoption("fbvm_traces"):
        from fbvm.testing.pages import file_name
        from fbvm.testing.recorded import Recorded

        Path(folder).mkdir(parents=True, exist_ok=True)
        name = f"{file_name(request.node.nodeid)}.{_rigs(request.node).index(rig)}.fbtrace"
        recorded = Recorded(rig, Path(folder) / name)
        attached.callback(lambda: recorded.path)
    request.addfinalizer(attached.close)


# --- failures ---------------------------------------------------------------------------------------------------------


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, None, None]:
    """A test that leaves forces behind has failed."""
    yield
    left = [name.removeprefix(rig.subject.prefix) for rig in _rigs(item) for name in rig.plc.forces]
    if left:
        pytest.fail(f"left forced: {', '.join(left)}; end a force with unforce(), or hold it by `with rig.force(...):`",
                    pytrace=False)  # fmt: skip


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Adds a report about the variables that a failed test has read."""
    if call.excinfo is not None and RIGS in item.stash and not item.config.option.fulltrace:
        _shorten(call.excinfo.value)
    report = yield
    if report.failed and call.when == "call" and call.excinfo is not None and explains(item.config):
        failure = _assertion(call.excinfo, item)
        for rig, lines in _rigs_read(call.excinfo, _rigs(item)):
            text = "\n\n".join(part for part in (rig.explain(lines), _page(item, rig, lines, failure)) if part)
            if text:
                report.sections.append((f"fbvm {rig!r}", text))
    return report


def _shorten(error: BaseException) -> None:
    """Cuts frames of fbvm off the traceback of an error that the test has caused, such as a misspelt name."""
    own = type(error).__module__.startswith("fbvm.")
    if not own and not isinstance(error, LookupError | TypeError | ValueError | AttributeError | AssertionError | OSError):
        return
    entry, last = error.__traceback__, None
    while entry is not None:
        if not Path(entry.tb_frame.f_code.co_filename).is_relative_to(PACKAGE):  # frames of fbvm do not explain the test
            last = entry
        entry = entry.tb_next
    if last is not None:
        last.tb_next = None


def _assertion(excinfo: pytest.ExceptionInfo[BaseException], item: pytest.Item) -> str:
    """The statement of the test that failed, with its place, and the error, as pytest marks them."""
    own = [entry for entry in excinfo.traceback if Path(entry.path) == item.path] or list(excinfo.traceback)
    file = Path(own[-1].path)
    lines = _statement(str(file), own[-1].lineno + 1)
    place = f"{file.relative_to(item.config.rootpath) if file.is_relative_to(item.config.rootpath) else file}:{lines.start}"
    source = textwrap.dedent("".join(linecache.getline(str(file), number) for number in lines)).splitlines()
    error = excinfo.exconly().splitlines()
    return "\n".join([place, *(f">   {line}" for line in source), *(f"E   {line}" for line in error)])


def _page(item: pytest.Item, rig: Rig, lines: tuple[str, range] | None, failure: str) -> str:
    """Writes the page of a rig of a failed test; returns the line of the report that names the page, or ""."""
    number = "" if len(_rigs(item)) == 1 else f".{_rigs(item).index(rig)}"
    return failure_page(item, number, lambda path: rig.write_page(path, item.nodeid, lines, failure))


def _rigs_read(excinfo: pytest.ExceptionInfo[BaseException], rigs: Sequence[Rig]) -> list[tuple[Rig, tuple[str, range] | None]]:
    """The rigs whose variables the failed statement has read, with its file and lines; without such rigs, all rigs."""
    files = {file for rig in rigs for file, _, _ in rig.reads}
    for entry in reversed(excinfo.traceback):
        file = str(entry.path)
        if file not in files:
            continue
        lines = _statement(file, entry.lineno + 1)
        found = [rig for rig in rigs if any(name == file and line in lines for name, line, _ in rig.reads)]
        if found:
            return [(rig, (file, lines)) for rig in found]
    return [(rig, None) for rig in rigs]


def _statement(file: str, line: int) -> range:
    """The lines of the smallest statement that contains a line."""
    try:
        tree = ast.parse(Path(file).read_text(encoding="utf-8"))
    except (OSError, SyntaxError, ValueError):
        return range(line, line + 1)
    found = [range(node.lineno, (node.end_lineno or node.lineno) + 1) for node in ast.walk(tree)
             if isinstance(node, ast.stmt) and node.lineno <= line <= (node.end_lineno or node.lineno)]  # fmt: skip
    return min(found, key=len, default=range(line, line + 1))


# --- test modules of projects -----------------------------------------------------------------------------------------


class ProjectModule(pytest.Module):
    """A test module of a project or lesson, beside which others lie that have test modules of the same names.

    Unless a configuration says otherwise, pytest imports a module by the name of its file alone, and refuses a second one."""

    def collect(self) -> Iterable[pytest.Item | pytest.Collector]:
        """The tests of the module, which is imported by its path if another file was imported by its name."""
        option = self.config.option
        mode = option.importmode
        if _is_taken(self.path):
            option.importmode = "importlib"
        try:
            return list(super().collect())
        finally:
            option.importmode = mode


def pytest_pycollect_makemodule(module_path: Path, parent: pytest.Collector) -> ProjectModule | None:
    """Projects and lessons may lie side by side."""
    if project_folder(module_path) is None:
        return None
    made: ProjectModule = ProjectModule.from_parent(parent, path=module_path)
    return made


def _is_taken(path: Path) -> bool:
    """True if another file was imported by the name of a module that lies in no package."""
    file = getattr(sys.modules.get(path.stem), "__file__", None)
    return file is not None and not (path.parent / "__init__.py").exists() and Path(file) != path


# --- tests in ST ------------------------------------------------------------------------------------------------------


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> StFile | None:
    """`test_*.st`: each PROGRAM is a test."""
    if file_path.suffix.lower() != ".st" or not file_path.name.startswith("test_"):
        return None
    from fbvm.testing.st_items import StFile

    made: StFile = StFile.from_parent(parent, path=file_path)
    return made
