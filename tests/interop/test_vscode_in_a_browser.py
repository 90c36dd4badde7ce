"""The extension in a real VS Code: code-server, driven in Chromium through playwright, where all three are there.

`.ci/code-server FOLDER` installs one; FBVM_CODE_SERVER names the folder."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.slow
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
ENTRY = "node_modules/code-server/out/node/entry.js"
BUILD = Path(__file__).parents[2] / "editors" / "vscode" / "build_vsix.py"
WAIT_MS = 60_000
PUMP = """\
PROGRAM Main
VAR
    Start AT CIO 0.00 : BOOL;
    Count AT D200 : INT;
    Level : INT;
END_VAR
    Level := Level + 3;
    IF Levl > 10 THEN
        Count := Count + 1;
        Level := 0;
    END_IF
END_PROGRAM
"""
TEST = """\
PROGRAM The_level_rises
VAR Level : INT; END_VAR
    Level := Level + 1;
    ASSERT(Level = 1);
END_PROGRAM
"""
PYTHON_TEST = """\
from fbvm import compile_text


def test_it_compiles():
    assert compile_text("PROGRAM Main END_PROGRAM").image
"""

LAMP = """\
<?xml version="1.0" encoding="utf-8"?>
<TcPlcObject Version="1.1.0.1">
  <POU Name="FB_Lamp">
    <Declaration><![CDATA[FUNCTION_BLOCK FB_Lamp
VAR_OUTPUT
    bOn : BOOL;
END_VAR]]></Declaration>
    <Implementation>
      <ST><![CDATA[bOff := TRUE;]]></ST>
    </Implementation>
  </POU>
</TcPlcObject>
"""


@pytest.fixture(scope="module")
def code_server() -> list[str]:
    """The command of a code-server."""
    folder, node = os.environ.get("FBVM_CODE_SERVER"), shutil.which("node")
    if not folder or not node or not (Path(folder) / ENTRY).is_file():
        pytest.skip("needs code-server: .ci/code-server FOLDER installs one, FBVM_CODE_SERVER names the folder")
    return [node, str(Path(folder) / ENTRY)]


@pytest.fixture
def address(code_server: list[str], tmp_path: Path) -> Iterator[str]:
    """The address of a VS Code with the extension, in which the folder `work` is open."""
    work, user = tmp_path / "work", tmp_path / "user"
    work.mkdir()
    (work / "pump.st").write_text(PUMP, encoding="utf-8")
    (work / "tank.st").write_text(PUMP.replace("Levl", "Level"), encoding="utf-8")
    (work / "FB_Lamp.TcPOU").write_text(LAMP, encoding="utf-8")
    (work / "test_level.st").write_text(TEST, encoding="utf-8")
    (work / "test_compiles.py").write_text(PYTHON_TEST, encoding="utf-8")
    fbvm = tmp_path / "fbvm"
    fbvm.write_text(f'#!/bin/sh\nexec {sys.executable} -m fbvm "$@"\n', encoding="utf-8")
    fbvm.chmod(0o755)
    (user / "Machine").mkdir(parents=True)
    (user / "Machine" / "settings.json").write_text(json.dumps({
        "fbvm.path": str(fbvm), "workbench.startupEditor": "none", "telemetry.telemetryLevel": "off", "update.mode": "none",
        "extensions.autoUpdate": False, "extensions.ignoreRecommendations": True}), encoding="utf-8")  # fmt: skip
    subprocess.run([sys.executable, BUILD, tmp_path], check=True, stdout=subprocess.DEVNULL)
    folders = ["--user-data-dir", str(user), "--extensions-dir", str(tmp_path / "extensions")]
    environment = {**os.environ, "XDG_CONFIG_HOME": str(tmp_path / "config")}
    package = next(tmp_path.glob("*.vsix"))
    subprocess.run([*code_server, *folders, "--install-extension", package], check=True, env=environment, capture_output=True)
    command = [*code_server, *folders, "--auth", "none", "--bind-addr", "127.0.0.1:0", "--disable-telemetry",
               "--disable-update-check", "--disable-workspace-trust", "--disable-getting-started-override",
               str(work)]  # fmt: skip
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        try:
            assert process.stdout is not None
            said = next(found[1] for line in process.stdout if (found := re.search(r"listening on (http://\S+)", line)))
            yield f"{said}?folder={work}"
        finally:
            process.terminate()


@pytest.fixture
def page(address: str) -> Iterator[Any]:
    playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright: pip install 'fbvm[browser]'")
    program = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if program is None:
        pytest.skip(f"needs a browser: {' or '.join(BROWSERS)}")
    with playwright.sync_playwright() as running:
        root = hasattr(os, "geteuid") and os.geteuid() == 0
        browser = running.chromium.launch(executable_path=program, args=["--no-sandbox"] if root else [])
        opened = browser.new_context(viewport={"width": 1500, "height": 1800}).new_page()
        opened.set_default_timeout(WAIT_MS)
        opened.goto(address)
        yield opened
        browser.close()


def row(page: Any, name: str) -> Any:
    """A row of the view of variables, or of the explorer."""
    return page.get_by_role("treeitem").filter(has_text=re.compile(rf"^{re.escape(name)}\s*(=|$)")).first


def value(page: Any, name: str, wanted: str) -> None:
    """Waits until a variable is shown with a value."""
    page.get_by_role("treeitem", name=f"{name}, value {wanted}").first.wait_for()


def tool(page: Any, name: str) -> None:
    """Presses a button of the debugger's tool bar."""
    page.locator(f".debug-toolbar a[aria-label^='{name}']").click()


def test_from_a_mistake_to_a_step_back_and_a_green_test(page: Any) -> None:
    row(page, "pump.st").dblclick()
    page.locator(".squiggly-error").first.wait_for()
    page.locator(".view-line", has_text="Levl").get_by_text("Levl").first.click()
    page.keyboard.press("Control+.")
    page.get_by_text("Write Level").wait_for()
    page.keyboard.press("Enter")
    page.locator(".squiggly-error").first.wait_for(state="detached")
    page.keyboard.press("Control+s")
    page.locator(".tab.dirty").wait_for(state="detached")

    page.keyboard.press("F5")
    page.get_by_text("scan 0, 0s").first.wait_for()
    page.get_by_text("Areas", exact=True).click()
    for name in ("D", "[0..9999]", "[200..299]"):
        row(page, name).click()
    row(page, "D200").click(button="right")
    page.get_by_text("Break on Value Change").click()
    page.locator(".debug-breakpoints .monaco-list-row", has_text="D200").first.wait_for()
    page.keyboard.press("F5")
    page.get_by_text("D200 was 0, is 1, by pump.st:9").first.wait_for()
    value(page, "D200", "1 (16#0001)")
    value(page, "Level", "12")
    tool(page, "Step Back")
    value(page, "D200", "0 (16#0000)")
    page.get_by_text("back in scan 3").first.wait_for()
    page.get_by_text("9:9", exact=True).wait_for()
    tool(page, "Step Back")
    page.get_by_text("8:5", exact=True).wait_for()
    tool(page, "Stop")
    page.locator(".debug-toolbar").wait_for(state="hidden")

    page.keyboard.press("Control+Shift+e")
    row(page, "test_level.st").dblclick()
    page.locator(".testing-run-glyph").first.click()
    page.locator(".codicon-testing-passed-icon, .testing-passed, .codicon-testing-passed").first.wait_for()
    assert page.locator(".squiggly-error").count() == 0

    row(page, "test_compiles.py").dblclick()
    page.locator(".view-line", has_text="test_it_compiles").wait_for()
    page.locator(".testing-run-glyph").first.click()
    page.locator(".codicon-testing-passed-icon, .testing-passed, .codicon-testing-passed").first.wait_for()


def command(page: Any, name: str) -> None:
    """Carries out a command by its name."""
    page.keyboard.press("F1")
    page.keyboard.type(name)
    page.get_by_role("option", name=re.compile(re.escape(name), re.I)).first.wait_for()
    page.keyboard.press("Enter")


def test_a_task_says_no_mistake_twice_and_the_walkthrough_opens(page: Any) -> None:
    row(page, "pump.st").dblclick()
    page.locator(".squiggly-error").first.wait_for()
    page.locator(".view-line", has_text="Levl").first.click()
    command(page, "fbvm: Check the program")
    page.locator(".terminal-tabs-entry, .single-terminal-tab").filter(has_text="check").locator(".codicon-error").wait_for()
    command(page, "Problems: Focus on Problems View")
    problems = page.get_by_role("treeitem").filter(has_text="Levl is not declared")
    problems.first.wait_for()
    assert problems.count() == 1, "the server tells of files that are open, and the task of others"
    command(page, "Welcome: Open Walkthrough")
    page.get_by_role("option", name=re.compile("PLC programs without a PLC")).first.click()
    page.get_by_text("Stop in it, and go back").first.click()
    page.get_by_text("Breakpoints on lines and on addresses").first.wait_for()


def test_a_mistake_in_an_object_of_twincat_is_underlined_in_its_xml(page: Any) -> None:
    row(page, "FB_Lamp.TcPOU").dblclick()
    page.locator(".squiggly-error").first.wait_for()
    page.locator(".view-line", has_text="bOff").get_by_text("bOff").first.hover()
    page.get_by_text("bOff is not declared").first.wait_for()


def test_the_live_page_stands_beside_the_code(page: Any) -> None:
    row(page, "tank.st").dblclick()
    page.locator(".view-line", has_text="Count := Count + 1").first.click()
    page.keyboard.press("F1")
    page.keyboard.type("fbvm: Live page")
    page.keyboard.press("Enter")
    inner = page.frame_locator("iframe.webview").frame_locator("#active-frame").frame_locator("iframe")
    inner.locator("#source td", has_text="Level := Level + 3;").first.wait_for()
    inner.locator("#state[data-state=run]").wait_for()
    inner.locator("#source tr", has_text="Count := Count + 1;").locator("button.chip b", has_text="1").first.wait_for()
