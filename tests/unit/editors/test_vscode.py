"""The extension for VS Code says the same as the command, and its package holds what is listed."""

from __future__ import annotations

import importlib.util
import json
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import pytest

from fbvm.base.dialects import DIALECTS
from fbvm.cli.shared.debug.attach import ATTACH
from fbvm.cli.shared.debug.launch import LAUNCH
from fbvm.engine.choice.tiers import CHOICES

HERE = Path(__file__).resolve().parents[3] / "editors" / "vscode"
JSON_TYPES = {"string": str, "array": list, "object": dict, "boolean": bool, "integer": int}
needs_node = pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")


def package() -> dict[str, Any]:
    found: dict[str, Any] = json.loads((HERE / "package.json").read_text(encoding="utf-8"))
    return found


def scripts() -> str:
    return "".join(path.read_text(encoding="utf-8") for path in sorted(HERE.glob("*.js")))


def test_the_package_holds_what_is_listed_and_is_the_same_each_time(tmp_path: Path) -> None:
    described = importlib.util.spec_from_file_location("build_vsix", HERE / "build_vsix.py")
    assert described is not None and described.loader is not None
    script = importlib.util.module_from_spec(described)
    described.loader.exec_module(script)
    made = script.build(tmp_path)
    before = made.read_bytes()
    assert script.build(tmp_path).read_bytes() == before
    with zipfile.ZipFile(made) as archive:
        held = set(archive.namelist())
        assert archive.read("extension/package.json") == (HERE / "package.json").read_bytes()
        assert 'Id="fbvm" Version="0.2.0"' in archive.read("extension.vsixmanifest").decode()
    own = {path.relative_to(HERE).as_posix() for path in HERE.rglob("*") if path.is_file()
           and path.suffix in (".js", ".json", ".md")}
    assert held == {"extension.vsixmanifest", "[Content_Types].xml", "extension/LICENSE.txt",
                    *(f"extension/{name.replace('README', 'readme')}" for name in own)}


def test_files_that_the_package_names_are_there() -> None:
    contributes = package()["contributes"]
    named = [each["path"] for each in (*contributes["grammars"], *contributes["snippets"])]
    named += [each["configuration"] for each in contributes["languages"]]
    named += [step["media"]["markdown"] for step in contributes["walkthroughs"][0]["steps"]]
    assert [name for name in named if not (HERE / name).is_file()] == []


def test_commands_are_those_that_the_extension_has_and_the_server_names() -> None:
    commands = {each["command"].removeprefix("fbvm.") for each in package()["contributes"]["commands"]}
    debugger = (HERE / "debugging.js").read_text(encoding="utf-8").partition("const commands = {")[2].partition("\n};")[0]
    registered = {*re.findall(r"(?<!\.)\bon\('(\w+)', ", scripts()), *re.findall(r"^  (\w+): ", debugger, re.M)}
    assert commands == registered
    assert {"run", "debug", "chart", "test", "debugTest"} <= commands


def test_configurations_have_the_keys_that_the_debugger_takes() -> None:
    described = package()["contributes"]["debuggers"][0]
    for request, keys in (("launch", LAUNCH), ("attach", ATTACH)):
        offered = described["configurationAttributes"][request]["properties"]
        assert set(offered) == set(keys) - {"noDebug"}
        for name, row in offered.items():
            named = [row["type"]] if isinstance(row["type"], str) else row["type"]
            assert {JSON_TYPES[kind] for kind in named} == set(keys[name]), name
    assert set(described["configurationAttributes"]["launch"]["properties"]["dialect"]["enum"]) == set(DIALECTS)
    assert set(described["configurationAttributes"]["launch"]["properties"]["engine"]["enum"]) == set(CHOICES)
    for snippet in described["configurationSnippets"]:
        body = snippet["body"]
        assert set(body) - {"type", "request", "name"} <= set(described["configurationAttributes"][body["request"]]["properties"])


def test_dialects_of_the_setting_are_those_of_the_compiler() -> None:
    offered = package()["contributes"]["configuration"]["properties"]["fbvm.dialect"]["enum"]
    assert set(offered) == set(DIALECTS)


def test_the_problem_matcher_reads_what_check_prints() -> None:
    from fbvm.code.compiler import compile_text

    pattern = package()["contributes"]["problemMatchers"][0]["pattern"]
    line = compile_text("PROGRAM Main\nx := 1;\nEND_PROGRAM\n", "main.st").errors[0].render().splitlines()[0]
    found = re.match(pattern["regexp"], line)
    assert found is not None
    assert [found[pattern[key]] for key in ("file", "line", "column", "severity", "code")] == [
        "main.st", "2", "1", "error", "S0201"]


def test_each_rule_that_a_grammar_includes_is_there() -> None:
    known = {}
    for path in sorted((HERE / "syntaxes").glob("*.json")):
        grammar = json.loads(path.read_text(encoding="utf-8"))
        known[grammar["scopeName"]] = {f"#{name}" for name in grammar.get("repository", {})}
        assert set(re.findall(r'"include": "(#[\w-]+)"', path.read_text(encoding="utf-8"))) <= known[grammar["scopeName"]]
    text = (HERE / "syntaxes" / "st.tmLanguage.json").read_text(encoding="utf-8")
    outside = set(re.findall(r'"include": "(source[\w.]+)"', text))
    assert outside <= set(known)


def test_nothing_is_needed_at_run_time() -> None:
    needed = set(re.findall(r"require\('([^']+)'\)", scripts()))
    assert {name for name in needed if not name.startswith("./")} == {"child_process", "fs", "os", "path", "vscode"}
    assert "dependencies" not in package()


SAID = """\
diagnostic: ["S0210","Pump has no Run\\ndid you mean Runs?",[{"line":3,"character":13},{"line":3,"character":16}]]
fixes: ["Write Runs"]
completion: ["Level","Runs"]
mended: []
rename: {"main.st":1,"Pump.st":1}
signature: ["Pump(Level := INT, Runs => BOOL)",0]
symbols: [["Main",["P1","On"]]]
lenses: ["Run","Debug","Chart"]
"""


@needs_node
@pytest.mark.slow
def test_the_client_of_the_extension_speaks_with_the_server(tmp_path: Path) -> None:
    (tmp_path / "Pump.st").write_text("FUNCTION_BLOCK Pump\nVAR_INPUT Level : INT; END_VAR\nVAR_OUTPUT Runs : BOOL; END_VAR\n"
                                      "Runs := Level < 200;\nEND_FUNCTION_BLOCK\n", encoding="utf-8")
    (tmp_path / "main.st").write_text("PROGRAM Main\nVAR P1 : Pump; On AT %QX0.0 : BOOL; END_VAR\n    P1(Level := 100);\n"
                                      "    On := P1.Run;\nEND_PROGRAM\n", encoding="utf-8")
    stub = Path(__file__).parent / "vscode_stub.js"
    done = subprocess.run(["node", stub, HERE, tmp_path, sys.executable, "-m", "fbvm", "lsp"], capture_output=True, text=True,
                          check=False, timeout=120)
    assert (done.stdout, done.stderr) == (SAID, "")


SHOWN = """\
test_lamp.py test_it_counts line 7
test_lamp.py test_rows line 11
test_lamp.py TestMore.test_inside line 15
test_level.st Wrong line 5
test_level.st Right line 1
failed test_lamp.py TestMore.test_inside at line 16
failed test_lamp.py test_rows at line 12
failed test_level.st Wrong at line 6
passed test_lamp.py test_it_counts
passed test_level.st Right
"""


@needs_node
@pytest.mark.slow
def test_the_view_of_tests_has_those_in_structured_text_and_those_of_pytest(tmp_path: Path) -> None:
    (tmp_path / "test_level.st").write_text("PROGRAM Right\n    ASSERT(TRUE);\nEND_PROGRAM\n\nPROGRAM Wrong\n    ASSERT(FALSE);\n"
                                            "END_PROGRAM\n", encoding="utf-8")
    (tmp_path / "test_lamp.py").write_text(
        "import pytest\n\nfrom fbvm import compile_text\n\n\n# one for all\ndef test_it_counts():\n    assert compile_text\n\n"
        "@pytest.mark.parametrize('n', [1, 2, 3])\ndef test_rows(n):\n    assert n != 2\n\nclass TestMore:\n"
        "    def test_inside(self):\n        assert False\n", encoding="utf-8")  # fmt: skip
    (tmp_path / "test_other.py").write_text("def test_of_somebody_else():\n    pass\n", encoding="utf-8")
    stub = Path(__file__).parent / "vscode_tests_stub.js"
    done = subprocess.run(["node", stub, HERE, tmp_path, sys.executable, "-m", "fbvm"], capture_output=True, text=True,
                          check=False, timeout=120)
    assert sorted(done.stdout.splitlines()) == sorted(SHOWN.splitlines()) and done.stderr == ""


@needs_node
@pytest.mark.slow
def test_the_scripts_are_javascript() -> None:
    for path in sorted(HERE.glob("*.js")):
        done = subprocess.run(["node", "--check", path], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
