"""No verb lets a control or escape character of its input through to the terminal, wherever the input is echoed."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from old_files import write_old_journal
from rows import each_of

from fbvm.base.printable import one_line, printable
from fbvm.cli.main import GROUP_OF, main

EVIL = "\x1b]0;owned\x07\x1b[31m\x9b2J\x7f\u202e\r"
"""Title, colour, clear screen, delete, right to left, carriage return."""
FOLDER = Path(__file__).parents[3] / "fbvm" / "cli"
COUNTER = "PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM\n"
WRONG = f"PROGRAM Main VAR n : INT; s : STRING; END_VAR n := 'x{EVIL}y'; (* {EVIL} *) m{EVIL} := 1; END_PROGRAM\n"
TRAPPED = f"PROGRAM Main VAR n : INT; s : STRING := '{EVIL[:5]}'; END_VAR n := 1 / n; END_PROGRAM\n"
PROJECT = f"[plc.a]\nsources = ['counter.st']\nuntil = 'Main.n > 2'\nwatch = ['Main.n']\n"  # noqa: F541 - stands beside others
NAME = f"a{EVIL}\n.st"
TOML = {
    "key": '"b\\u001b[31m\\n" = 1\n' + PROJECT,
    "plc": PROJECT.replace("plc.a", 'plc."a\\u001b[31m\\n"'),
    "value": PROJECT.replace("'Main.n > 2'", '"Main.\\u001b[31m\\n > 2"'),
    "source": PROJECT.replace("'counter.st'", '"c\\u001b[31m\\n.st"'),
    "watch": PROJECT.replace("'Main.n']", '"Main.\\u001b[31m\\n"]'),
    "none": PROJECT.replace("plc.a", f"plc.a{EVIL}"),
    "set": PROJECT + 'set = [{name = "n\\u001b[31m\\n", value = "\\u001b[31m\\n"}]\n',
    "unit": PROJECT + '[[plc.a.unit]]\naddress = "\\u001b[31m\\n"\n[[door]]\naddress = "1.2.3.4:1"\nbind = "\\u001b[31m\\n:1"\n',
    "kind": PROJECT + '[[fault]]\nkind = "\\u001b[31m\\n"\nerror = "\\u001b[31m"\n',
}
XML = """<project xmlns='http://www.plcopen.org/xml/tc6_0201'><types><pous>
<pou name='a&#x9b;&#x202e;&#10;' pouType='program'><body><ST>x&#x9b; := ;</ST></body></pou></pous></types></project>"""
Fbvm = Callable[..., Result]


@pytest.fixture
def fbvm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Fbvm:
    """Runs the command in a folder of files that mean harm; what it prints has to be harmless."""
    monkeypatch.chdir(tmp_path)
    Path("counter.st").write_text(COUNTER, encoding="utf-8")
    for name, text in (("wrong.st", WRONG), ("trapped.st", TRAPPED), (NAME, COUNTER), (f"w{NAME}", WRONG)):
        Path(name).write_bytes(text.encode())

    def run(*arguments: str) -> Result:
        result = CliRunner().invoke(main, arguments, catch_exceptions=False, color=True)
        bare = re.sub(r"\x1b\[[0-9;]*m(?=[^\x1b]*\x1b\[0m)|\x1b\[0m", "", result.output)  # the colours of the verb itself
        harm = {character for character in bare if not character.isprintable() and character not in "\n\t"}
        assert not harm, (arguments, result.output)
        assert "owned\x07" not in result.output
        return result

    return run


def test_a_text_in_which_control_characters_are_shown() -> None:
    assert printable(f"a\n\tb{EVIL}c") == "a\n\tb\\x1b]0;owned\\x07\\x1b[31m\\x9b2J\\x7f\\u202e\\rc"
    assert printable("Pumpe läuft ▶ 水") == "Pumpe läuft ▶ 水"
    assert one_line("a\nb\tc\udcff") == "a\\nb\\tc\\udcff"


@pytest.mark.slow
def test_what_a_program_says_wrong(fbvm: Fbvm) -> None:
    for verb in ("check", "run", "list", "ladder", "sfc", "fmt", "step", "export"):
        extra = {"run": ("--scans", "2"), "export": ("-o", "out.xml"), "fmt": ("--check",)}.get(verb, ())
        for file in ("wrong.st", NAME, f"w{NAME}", f"no{NAME}"):
            if (verb, file) != ("step", NAME):
                fbvm(verb, file, *extra)
    assert fbvm("check", f"w{NAME}").stderr.count("\n") == fbvm("check", "wrong.st").stderr.count("\n"), "one line stays one"
    fbvm("fmt", "--diff", NAME)
    fbvm("fmt", NAME)
    for file in ("wrong.st", NAME, f"w{NAME}", f"no{NAME}"):
        fbvm("diff", file, "wrong.st")
        fbvm("diff", NAME, file)


@pytest.mark.slow
@each_of("name", TOML)
def test_what_a_project_says(fbvm: Fbvm, name: str) -> None:
    folder = Path(f"p{EVIL}")
    folder.mkdir(exist_ok=True)
    (folder / "counter.st").write_text(COUNTER, encoding="utf-8")
    (folder / "fbvm.toml").write_text(TOML[name], encoding="utf-8")
    for verb in ("check", "run", "step"):
        fbvm(verb, str(folder), *(("--scans", "2") if verb == "run" else ()))
    (folder / "fbvm.toml").unlink()
    fbvm("run", str(folder))
    text = f"[campaign]\n{json.dumps(EVIL)} = 1\n[[vary]]\nname = {json.dumps(EVIL)}\n"
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    fbvm("campaign", str(folder))
    fbvm("fleet", str(folder))


@pytest.mark.slow
def test_options_and_arguments(fbvm: Fbvm) -> None:
    for arguments in (
        ("explain", EVIL), (f"no{EVIL}",), (f"--no{EVIL}",), ("run", "counter.st", f"--no{EVIL}"), ("map", f"D{EVIL}"),
        ("run", "counter.st", "--until", EVIL), ("run", "counter.st", "--scans", "1", "--show", f"Main.{EVIL}"),
        ("run", "counter.st", "--scans", "1", "--set", f"Main.n={EVIL}"), ("run", "counter.st", "--scans", "1", "--map", EVIL),
        ("run", "counter.st", "--door", EVIL), ("run", "counter.st", "--scans", EVIL), ("serve", "--bind", EVIL),
        ("live", "counter.st", "--allow-write", EVIL), ("live", "counter.st", "--map", EVIL), ("live", f"no{EVIL}.st"),
        ("run", "counter.st", "--net", "tcp", "--scans", "1", "--map", f"1.2.3.4:1=h{EVIL}:1"), ("new", f"x/{EVIL}/y"),
        ("run", "counter.st", "--scans", "1", "--trace", f"no{EVIL}/t.trace"), ("serve", "--image", f"no{EVIL}/i"),
        ("run", "counter.st", "--scans", "1", "--program", EVIL), ("check", "counter.st", "--no-warn", EVIL),
        ("run", "trapped.st", "--scans", "1"), ("run", "trapped.st", "--scans", "1", "--show", "Main.s", "--json"),
        ("run", "trapped.st", "--scans", "1", "--show", "Main.s"), ("learn", EVIL), ("test", EVIL),
        ("prove", "counter.st", "--never", EVIL), ("prove", "counter.st", "--always", f"Main.{EVIL} = 1"),
        ("prove", f"no{EVIL}.st"), ("mutate", f"no{EVIL}.st"), ("mutate", "--tests", EVIL, "counter.st"),
        ("campaign", f"no{EVIL}.st"), ("campaign", "counter.st", "--for", "20ms", "--vary", f"Main.{EVIL}=1"),
        ("campaign", "counter.st", "--for", "20ms", "--never", EVIL),
        ("campaign", "trapped.st", "--for", "20ms", "--out", f"o{EVIL}"),
        ("sweep", "counter.st", "--for", "20ms", "--vary", f"Main.n={EVIL}"),
        ("sweep", "trapped.st", "--for", "20ms", "--show", EVIL),
        ("fleet", f"no{EVIL}"), ("fleet", ".", "--cluster", EVIL), ("fleet", ".", "--doors", f"no{EVIL}/d.csv"),
    ):  # fmt: skip
        fbvm(*arguments)


@pytest.mark.slow
def test_recordings_and_journals(fbvm: Fbvm) -> None:
    fbvm("run", NAME, "--scans", "3", "--trace", f"t{EVIL}.trace", "--depth", "statements", "--journal", f"j{EVIL}.jsonl")
    for verb in ("chart", "table", "why", "convert", "replay"):
        for file in (f"t{EVIL}.trace", f"j{EVIL}.jsonl", NAME, "evil.csv", "evil.jsonl", f"no{EVIL}"):
            Path("evil.csv").write_text(f'scan,time,"Main.{EVIL}"\n0,0,1\n1,10,{EVIL}\n', encoding="utf-8")
            named = {"table": (file, f"Main.n{EVIL}"), "why": (f"Main.n{EVIL}", file), "convert": (file, "-o", f"o{EVIL}.x")}
            fbvm(verb, *named.get(verb, (file,)))
    write_old_journal(f"j{EVIL}.jsonl", Path(NAME).read_text(encoding="utf-8"), NAME)
    good = Path(f"j{EVIL}.jsonl").read_text(encoding="utf-8").splitlines()
    for number, line in enumerate(good[:3]):
        for key in json.loads(line):
            changed = json.loads(line) | {key: f"x{EVIL}\n"}
            Path("evil.jsonl").write_text("\n".join([*good[:number], json.dumps(changed), *good[number + 1 :]]), encoding="utf-8")
            fbvm("replay", "evil.jsonl")


@pytest.mark.slow
def test_images_and_documents(fbvm: Fbvm) -> None:
    for text in ('{"spaces": {"\x1b": []}}', json.dumps({"spaces": {EVIL: []}}), json.dumps({"spaces": {"D": [EVIL]}})):
        Path(f"i{EVIL}.json").write_text(text, encoding="utf-8")
        fbvm("serve", "--bind", "nobody", "--image", f"i{EVIL}.json")
    for text in (f"<a>{EVIL[:1]}</a>", "<project xmlns='x&#x9b;'/>", XML):
        Path(f"x{EVIL}.xml").write_text(text, encoding="utf-8")
        fbvm("import", f"x{EVIL}.xml", "-o", f"out{EVIL}")


def test_every_verb_is_tried() -> None:
    """The verbs that are not tried above have no input of others: what they echo is their own."""
    tried = set(re.findall(r'"([a-z]+)"', Path(__file__).read_text(encoding="utf-8").partition("def test_every_verb")[0]))
    assert set(GROUP_OF) - tried == {"dap", "demo", "lsp", "peer"}


@pytest.mark.slow
def test_nothing_prints_past_the_terminal_module() -> None:
    """Only `terminal.say` prints: click's own functions and `print` know nothing of control characters."""
    for path in FOLDER.rglob("*.py"):
        if path.name in ("terminal.py", "ending.py"):  # the other one has a sentence of its own for each signal, and no more
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call):
                called = ast.unparse(node.func)
                assert called not in ("click.echo", "click.secho", "print", "sys.stdout.write", "sys.stderr.write"), path
