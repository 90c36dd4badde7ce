"""Fixtures of the tests in a browser: Chromium through playwright, where both are there."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from live_pages import BROWSERS, PUMP, Live


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright: pip install 'fbvm[browser]'")
    program = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if program is None:
        pytest.skip(f"needs a browser: {' or '.join(BROWSERS)}")
    with playwright.sync_playwright() as running:
        root = hasattr(os, "geteuid") and os.geteuid() == 0
        started = running.chromium.launch(executable_path=program, args=["--no-sandbox"] if root else [])
        yield started
        started.close()


@pytest.fixture
def live(browser: Any, tmp_path: Path) -> Iterator[Any]:
    made: list[Live] = []

    def start(*options: str, text: str = PUMP, verb: str = "live") -> Live:
        made.append(Live(browser, tmp_path, text, *options, verb=verb))
        return made[-1]

    yield start
    for one in made:
        one.close()
