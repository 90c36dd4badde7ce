"""What the pages on editors give Helix has the form of its `languages.toml`, which knows no other keys."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

HOWTO = Path(__file__).resolve().parents[3] / "docs" / "howto"
LANGUAGE = {
    "name", "language-id", "scope", "file-types", "shebangs", "roots", "comment-token", "comment-tokens", "block-comment-tokens",
    "text-width", "soft-wrap", "auto-format", "formatter", "path-completion", "word-completion", "diagnostic-severity", "grammar",
    "injection-regex", "language-servers", "indent", "debugger", "auto-pairs", "rulers", "workspace-lsp-roots",
    "persistent-diagnostic-sources", "rainbow-brackets",
}  # fmt: skip
"""Keys of a language; any other is an error (Helix, `helix-core/src/syntax/config.rs`)."""
SERVER = {"command", "args", "config", "timeout", "environment", "required-root-patterns"}
"""Keys of a language server (ibid.)."""
DEBUGGER = {"name", "transport", "command", "args", "port-arg", "templates", "quirks"}
"""Keys of a debug adapter; a template has `name`, `request`, `completion` and `args` (`helix-core/src/syntax/config.rs`)."""


def languages(page: str) -> dict[str, Any]:
    """The `languages.toml` of a page."""
    text = (HOWTO / page).read_text(encoding="utf-8")
    found = next(block for block in re.findall(r"```toml\n(.*?)```", text, re.S) if "[[language]]" in block)
    return tomllib.loads(found)


def test_helix_knows_every_key_and_finds_the_language_server() -> None:
    made = languages("editors.md")
    language, = made["language"]
    assert set(language) <= LANGUAGE and {"name", "scope", "file-types"} <= set(language)
    assert set(language["indent"]) == {"tab-width", "unit"}
    assert set(language["block-comment-tokens"]) == {"start", "end"}
    servers = made["language-server"]
    assert [set(servers[name]) <= SERVER for name in language["language-servers"]] == [True]
    assert [servers["fbvm"]["command"], *servers["fbvm"]["args"]] == ["fbvm", "lsp"]


def test_helix_knows_every_key_of_the_debugger() -> None:
    debugger = languages("debugger.md")["language"][0]["debugger"]
    assert set(debugger) <= DEBUGGER and debugger["transport"] == "stdio"
    assert [debugger["command"], *debugger["args"]] == ["fbvm", "dap"]
    for template in debugger["templates"]:
        assert set(template) == {"name", "request", "completion", "args"} and template["request"] in ("launch", "attach")
