"""What all tests rely on."""

from __future__ import annotations

import gc
import os
import re
import signal
import sys
from collections.abc import Generator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from depth import SWITCH

if TYPE_CHECKING:
    from xdist.scheduler import Scheduling

# A shell's background jobs ignore Ctrl-C, and so would every program that a test starts and ends by it.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Who wants no bytecode beside the sources has it with what pytest keeps: half of the time of a short run goes into it.
if sys.dont_write_bytecode:
    sys.dont_write_bytecode = False
    sys.pycache_prefix = str(Path(__file__).parents[1] / ".pytest_cache" / "bytecode")
    os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix
    del os.environ["PYTHONDONTWRITEBYTECODE"]

# The cache of the tests is this checkout's: the user's own files and those of other checkouts neither leave it nor fill it.
os.environ.setdefault("FBVM_CACHE", str(Path(__file__).parents[1] / ".pytest_cache" / "fbvm"))

from hypothesis import settings


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--deep", action="store_true", help="Try many times as many examples, seeds and scans (hours).")


def pytest_configure(config: pytest.Config) -> None:
    """Before any test module is read: the numbers stand in decorators.  No example has a deadline: machines are noisy."""
    settings.register_profile("quick", deadline=None)
    settings.register_profile("deep", deadline=None, max_examples=2000)
    settings.load_profile("deep" if config.getoption("deep") else "quick")
    if config.getoption("deep"):
        os.environ[SWITCH] = "1"


TOP = len(Path(__file__).parts)
"""Parts of the path of a test file that stands in no folder of the tests."""
gc.set_threshold(400_000, 20, 50)  # what tests leave behind dies together: it is looked for seldom


ALL_SLOW = re.compile(r"^pytestmark = \[?pytest\.mark\.slow\b", re.M)


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """The inner loop does not import modules in which everything is slow, nor what only these import."""
    if config.option.markexpr != "not slow" or not collection_path.name.startswith("test_"):
        return None
    return True if ALL_SLOW.search(collection_path.read_text(encoding="utf-8")) else None


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int | None:
    """Three workers on two cores: slow tests wait a quarter of their time for sockets, pages and processes, unlike quick ones."""
    if config.option.markexpr == "not slow":
        return None
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return cores + cores // 2


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector: pytest.Collector) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Every other worker collects from the end: in a fresh checkout each makes bytecode of half of the files."""
    report = yield
    if isinstance(collector, pytest.Directory) and os.environ.get("PYTEST_XDIST_WORKER", "0")[-1] in "13579":
        report.result.reverse()
    return report


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Workers must have the same order: the long tests of whole pages and packages, which stand in no folder, come first, so that
    no worker begins one of them when the others have ended."""
    if "PYTEST_XDIST_WORKER" in os.environ:
        items.sort(key=lambda item: (len(item.path.parts) > TOP, item.path.parts))


def pytest_collection_finish() -> None:
    """Thousands of tests stay where they are until the end: the host need not look through them again and again."""
    gc.freeze()


@pytest.fixture
def frozen_heap() -> None:
    """What earlier tests have left is not looked through by a test that collects garbage again and again."""
    gc.collect()
    gc.freeze()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> Scheduling | None:
    """Each worker takes a part of the files, and at the end of what others have left: images and rigs that the tests of
    a file share are made once."""
    if config.getoption("dist") != "load":
        return None
    from xdist.scheduler import WorkStealingScheduling

    return WorkStealingScheduling(config, log)
