"""The live page in windows of a real browser, and what tests do with it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from forked_fbvm import Forked

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
PUMP = """
PROGRAM Main
VAR
    Level : INT := 20;      (* <script>document.title = 'broken'</script> *)
    Pump, Hand : BOOL;
    High AT D10 : INT := 90;
    Said : STRING[60] := '<img src=x onerror=document.title=1>';
END_VAR
IF Level >= High THEN Pump := TRUE; ELSIF Level <= 10 THEN Pump := FALSE; END_IF
IF Hand THEN
    Level := 0;
ELSIF Pump THEN
    Level := Level - 2;
ELSE
    Level := Level + 1;
END_IF
END_PROGRAM
"""


class Live:
    """`fbvm live` in a process of its own, and its page in windows."""

    def __init__(self, browser: Any, folder: Path, text: str, *options: str, verb: str = "live") -> None:
        self.file = file = folder / "pump.st"
        file.write_text(text)
        self._browser = browser
        given = [] if verb in ("serve", "demo", "learn") or options and options[-1].startswith(str(folder)) else [str(file)]
        self._process = Forked([verb, *given, *options])
        self.url = next((line.strip() for line in self._process.stdout if line.startswith("http:")), "")
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/#token=[\w-]{32,}", self.url), self._process.communicate()[1]
        self.complaints: list[str] = []

    def window(self, url: str = "", **settings: Any) -> Any:
        """The page in a window of its own; what it complains about is in `complaints`."""
        page = self._browser.new_context(**{"viewport": {"width": 1400, "height": 1000}, **settings}).new_page()
        page.set_default_timeout(90_000)  # a busy machine checks a lesson for a minute
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("console", lambda message: self.complaints.append(message.text) if message.type == "error" else None)
        page.goto(url or self.url)
        return page

    def close(self) -> None:
        for context in self._browser.contexts:
            context.close()
        self._process.terminate()
        self._process.communicate(timeout=30)


def watch(page: Any, name: str) -> Any:
    """Searches a name and watches it; returns its row."""
    page.fill("#find", name)
    page.locator("#found button").first.wait_for()
    page.press("#find", "Enter")
    row = page.locator(f"#watched tr[data-name='{name}']")
    row.wait_for()
    return row


def value(row: Any, text: str) -> None:
    row.locator(".value", has_text=re.compile(f"^{re.escape(text)}$")).wait_for()


def state(page: Any, name: str) -> None:
    page.locator(f"#state[data-state={name}]").wait_for()
