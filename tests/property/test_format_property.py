"""Formatting keeps the meaning and every comment, formats its own text to the same, and does not ask how a text was spaced."""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache, lru_cache, partial
from pathlib import Path
from typing import Any

import pytest
from depth import times
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from rows import go_through

from fbvm.base.diagnostics import Source, errors
from fbvm.code.compiler import compile_text
from fbvm.syntax.formatter.comments import Comments
from fbvm.syntax.formatter.formatter import REFUSED, formatted
from fbvm.syntax.formatter.names import Spelling
from fbvm.syntax.parser import parse
from fbvm.syntax.st.lexer import Lexer, Token, lexis
from fbvm.syntax.tree import Form, Literal, Node, SourceText
from fbvm.syntax.tree.node import names_of

ROOT = Path(__file__).resolve().parent.parent.parent
CORPUS = ("tests/lang/**/", "tests/golden/**/", "tests/bench/", "tests/conformance/", "fblib/**/", "examples/**/")
PROGRAMS = re.compile(r"(?m)^(?=// ----)")
"""Where a file of several programs is to be cut, so that an error in one does not hide the others."""
EXPECTS_ERROR = re.compile(r"// *error\b")
"""The comment of a program that shows an error, which may be one of syntax."""
WRONG = ROOT / "tests" / "golden" / "errors"
"""The folder of texts with errors of syntax."""
LONG = 100_000
"""Bytes of a file that takes seconds."""
PLACES = {"start", "end", "op_start"}


@cache
def programs(path: Path) -> list[str]:
    """The texts of a file that can be formatted: all but those of tests/golden/errors and those that expect an error."""
    readable = []
    for piece in PROGRAMS.split(path.read_text(encoding="utf-8")):
        wrong = parsed(piece)[1]
        assert not wrong or path.parent == WRONG or EXPECTS_ERROR.search(piece), f"{path.name}: {wrong[0]}"
        if piece.strip() and not wrong:
            readable.append(piece)
    return readable


@lru_cache(maxsize=256)
def parsed(text: str) -> tuple[SourceText, list[str]]:
    """The tree of a text and its errors of syntax; several tests want those of each program."""
    tree, diagnostics = parse(Source("x.st", text))
    return tree, [d.render() for d in errors(diagnostics) if d.code not in REFUSED]


FILES = sorted(path for folder in CORPUS for path in ROOT.glob(f"{folder}*.st"))


@cache
def corpus() -> list[str]:
    """Programs that are short enough to be changed and formatted many times."""
    return [text for path in FILES for text in programs(path) if len(text) < 6000]


PROGRAM_NUMBERS = st.deferred(lambda: st.sampled_from(range(len(corpus()))))
"""Which program of the corpus; it is read by the first test that wants one."""


@lru_cache(maxsize=4096)
def write(text: str) -> str:
    """The canonical form of a text; several tests want that of each program."""
    written, wrong = formatted(Source("x.st", text))
    assert not wrong
    return written


def tokens(text: str) -> list[Token]:
    return list(Lexer(text, lambda *message: None).tokens())


def comments(text: str) -> list[str]:
    """All comments and pragmas in order; how far their lines are indented does not count."""
    found = Comments(text, tokens(text))
    places = [*((start, c) for start, cs in found.ahead.items() for c in cs),
              *((end, c) for end, cs in found.behind.items() for c in cs)]
    ordered = sorted(places, key=lambda item: item[0])
    return ["\n".join(line.strip() for line in comment.text.split("\n")) for _, comment in ordered]


SPELLINGS = ("spaced_durations", "bits_by_name", "doubled_quotes", "glued_words")
"""Forms that the canonical form does not have: `T# 5s` becomes `T#5s`, `w.%Xk` becomes `w.k`, '''' becomes '$'', `-1DO` becomes
`-1 DO`."""


def meaning(value: Any) -> Any:
    """A tree as plain data without places, names without case, values to the letter."""
    if isinstance(value, Literal):
        return value.kind, repr(value.value), value.type_name
    if isinstance(value, Form):
        return value.switch, value.taken
    if isinstance(value, Node):
        return type(value).__name__, [meaning(getattr(value, name)) for name in names_of(value) if name not in PLACES]
    if isinstance(value, tuple):
        return [meaning(item) for item in value if not (isinstance(item, Form) and item.switch in SPELLINGS)]
    return " ".join(value.upper().split()) if isinstance(value, str) else value


def check(text: str) -> str:
    """Everything that is always true, for one text; its canonical form."""
    written = write(text)
    tree, wrong = parsed(written)
    assert wrong == []
    assert written == text or meaning(parsed(text)[0]) == meaning(tree)
    assert written == text or comments(text) == comments(written)
    assert write(written) == written
    assert not re.search(r"[ \t]$", written, re.MULTILINE) and written.strip() + "\n" == written
    return written


def each_folder(quick: tuple[str, ...]) -> Callable[[Callable[[Path], None]], Callable[[list[Path]], None]]:
    """A test of each file, all of a folder together; those of other folders than the `quick` ones, and long files, are for the
    long run."""

    def decorate(test: Callable[[Path], None]) -> Callable[[list[Path]], None]:
        @parts
        def through(files: list[Path]) -> None:
            go_through((path.name, partial(test, path)) for path in files)

        return through

    groups: dict[tuple[str, bool], list[Path]] = {}
    for path in FILES:
        folder = path.parent.relative_to(ROOT).as_posix()
        groups.setdefault((folder, not folder.startswith(quick) or path.stat().st_size > LONG), []).append(path)
    parts = pytest.mark.parametrize("files", [
        pytest.param(files, id=folder, marks=[pytest.mark.slow] * is_slow) for (folder, is_slow), files in groups.items()])
    return decorate


@each_folder(("tests/golden", "examples/lessons"))
def test_every_program_keeps_its_meaning(path: Path) -> None:
    for text in programs(path):
        check(text)


@lru_cache(maxsize=1)
def image(text: str) -> object:
    """What would be executed, without lines and columns; names in charts without their case.  Most programs are canonical.

    Code is compared as text, because NAN is not equal to itself."""
    named = re.search(r"(?m)^// dialect (\w+)$", text)
    made = compile_text(text, dialect=named[1] if named else "standard").image
    if made is None:
        return None
    sites = tuple(replace(site, line=0, column=0) for site in made.sites)
    empty = tuple(replace(body, code=()) for body in made.bodies)
    code = [repr(body.code) for body in made.bodies]
    return replace(made, sites=sites, charts=(), bodies=empty), code, repr(made.charts).casefold()


@pytest.mark.slow
@each_folder(())
def test_every_program_is_compiled_to_the_same_image(path: Path) -> None:
    for text in programs(path):
        assert write(text) == text or image(text) == image(write(text))


# --- changes that must not matter ---

def respaced(text: str, chance: random.Random) -> str:
    """Other spaces and line ends between tokens where no comment is, and words of the language in another case."""
    parts: list[str] = []
    end = 0
    for token in tokens(text):
        gap = text[end:token.start]
        if not gap.strip() and gap.count("\n") < 2 and end and token.type != "$END":
            gap = chance.choice(SPACES[not gap])
        parts += (gap, chance.choice(CASES)(token.text) if token.type in lexis().reserved else token.text)
        end = token.end
    return "".join(parts)


SPACES = ([" ", "   ", "\t", "\n", " \n    ", "\r\n\t "], ["", "", "", " ", "\n"])
"""What may stand in place of a gap, and of none."""
CASES = (str.upper, str.lower, str.title, str)
WHOLE = {"REFUSED_BLOCK", "REFUSED_SECTION", "TRY", "INSTRUCTION_LIST"}
"""Words that begin a text which is kept as it is."""


def renamed(text: str, chance: random.Random) -> str:
    """Names in another case, where something is known about them."""
    for start, name in Spelling(parsed(text)[0]).at.items():
        if text[start:start + len(name)].upper() == name.upper():  # a generic type stands for the one that limits it
            text = text[:start] + chance.choice(CASES)(name) + text[start + len(name):]
    return text


def commented(text: str, chance: random.Random) -> str:
    """Comments and pragmas in any places."""
    places = sorted({chance.choice(tokens(text)).start for _ in range(chance.randint(1, 8))}, reverse=True)
    for number, place in enumerate(places):
        comment = chance.choice(REMARKS).format(number)
        text = text[:place] + comment + text[place:]
    return text


REMARKS = (" (* c{} *) ", " // c{}\n", "\n// c{}\n", "\n\n  // c{}\n\n", " /* c{} */ ", "\n(* c{}\n   more *)\n",
           " {{region {}}} ", " (* c{} *) // d\n", "\n// c{}\n    // d\n")


@pytest.mark.slow
@settings(deadline=None)
@given(PROGRAM_NUMBERS, st.randoms(use_true_random=False))
def test_spaces_line_ends_and_case_of_words_do_not_matter(number: int, chance: random.Random) -> None:
    text = corpus()[number]
    assume(not any("\n" in comment for comment in comments(text)) and not any(t.type in WHOLE for t in tokens(text)))
    assert write(respaced(text, chance)).replace("\r\n", "\n") == write(text)


@pytest.mark.slow
@settings(deadline=None)
@given(PROGRAM_NUMBERS, st.randoms(use_true_random=False))
def test_names_are_written_as_they_are_declared(number: int, chance: random.Random) -> None:
    text = corpus()[number]
    assert write(renamed(text, chance)) == write(text)


@pytest.mark.parametrize("condition", ["LADDER\nLD a\nOUT Go\nEND_LADDER", "    LD a\n    ST b"])
def test_the_name_of_a_transition_is_declared_where_it_stands(condition: str) -> None:
    chart = f"INITIAL_STEP s: END_STEP\nTRANSITION Go FROM s TO s:\n{condition}\nEND_TRANSITION"
    text = f"PROGRAM Main\nVAR a, b : BOOL; END_VAR\n{chart}\nEND_PROGRAM\n"
    assert text.index("Go") not in Spelling(parsed(text)[0]).at


@pytest.mark.slow
@settings(deadline=None, max_examples=times(100))
@given(PROGRAM_NUMBERS, st.randoms(use_true_random=False))
def test_comments_may_stand_anywhere(number: int, chance: random.Random) -> None:
    text = commented(corpus()[number], chance)
    assume(not parsed(text)[1])
    check(text)
