"""Proofs that are kept on disk: one cache for `fbvm prove` and for tests; what makes another proof; files that are broken."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner
from rows import each_of

from fbvm.cli.main import main
from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.prove import stored
from fbvm.prove.prover import Limits
from fbvm.prove.question import NEVER, REACH, WITHIN, Question, Verdict
from fbvm.testing import proved
from fbvm.testing.plugin import RigMaker

TEXT = """PROGRAM Main
VAR
    a AT %IW0 : INT (0..10);
    b : INT;
END_VAR
    b := a;
END_PROGRAM
"""
ASKED = Question(NEVER, "Main.b > 10")


def image_of(text: str) -> Image:
    found = compile_text(text, lint=False).image
    assert found is not None
    return found


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[Question]:
    """The questions that were answered without the cache, which is empty at first."""
    monkeypatch.setenv("FBVM_CACHE", str(tmp_path / "cache"))
    found: list[Question] = []
    prove: Callable[..., Verdict] = stored.prove
    monkeypatch.setattr(stored, "prove", lambda image, question, *given: found.append(question) or prove(image, question, *given))
    return found


@pytest.mark.slow
def test_a_proof_is_made_once(made: list[Question]) -> None:
    first, second = (stored.proved_once(image_of(TEXT), ASKED, Limits()) for _ in range(2))
    assert (len(made), first.is_kept, second.is_kept) == (1, False, True)
    assert replace(second, is_kept=False) == first


LATER = Question(WITHIN, "Main.b >= 0", trigger="Main.a > 3", within_ns=10_000_000)
OTHER = [
    (TEXT, ASKED, Limits(20_000_000)), (TEXT, ASKED, Limits(longest_ns=20_000_000)),
    (TEXT, replace(ASKED, text="Main.b > 11"), Limits()), (TEXT, replace(ASKED, assumptions=("Main.a < 5",)), Limits()),
    (TEXT, replace(ASKED, lemmas=("Main.b < 20",)), Limits()),
    (TEXT, replace(ASKED, free=("D0",)), Limits()), (TEXT.replace("b := a", "b := a / 2"), ASKED, Limits()),
    (TEXT, LATER, Limits()), (TEXT, replace(LATER, trigger="Main.a > 4"), Limits()),
    (TEXT, replace(LATER, within_ns=1), Limits()),
]  # fmt: skip


def test_another_program_property_or_time_is_another_proof(made: list[Question]) -> None:
    stored.proved_once(image_of(TEXT), ASKED, Limits())
    for text, question, limits in OTHER:
        assert stored.proved_once(image_of(text), question, limits).is_kept is False, (text, question, limits)


def test_what_the_type_of_an_input_says_belongs_to_the_proof(made: list[Question]) -> None:
    assert stored.proved_once(image_of(TEXT), ASKED, Limits()).word == "proved"
    assert stored.proved_once(image_of(TEXT.replace("0..10", "0..20")), ASKED, Limits()).word == "broken"


REACHES = [Question(REACH, "Main.b > 10"), Question(REACH, "Main.b > 9"), Question(NEVER, "Main.b > 9")]


@each_of("question", REACHES)
def test_what_no_run_reaches_is_kept_and_the_shortest_run_that_does(made: list[Question], question: Question) -> None:
    first, second = (stored.proved_once(image_of(TEXT), question, Limits()) for _ in range(2))
    assert (first.is_kept, second.is_kept, made.count(question)) == (False, True, 1)
    assert replace(second, is_kept=False) == first


MIX = """PROGRAM Main
VAR
    Go AT %IX0.0 : BOOL;
    Stop AT %IX0.1 : BOOL;
    r  AT %ID4 : REAL;
    Number AT %IW2 : INT;
    Sum : DINT;
END_VAR
    IF Go AND NOT Stop AND r > 1.5 THEN
        Sum := Sum + INT_TO_DINT(Number);
        Number := 0;
    END_IF;
END_PROGRAM
"""


@pytest.mark.slow
def test_a_run_of_many_inputs_that_the_program_writes_too_is_kept_as_it_is(made: list[Question]) -> None:
    question, limits = Question(REACH, "Main.Sum = 40000"), Limits(longest_ns=20_000_000)
    first, second = (stored.proved_once(image_of(MIX), question, limits) for _ in range(2))
    assert (first.word, second.is_kept, first.run and first.run.scans) == ("reached", True, 2)
    assert replace(second, is_kept=False) == first


def test_a_run_that_does_something_else_by_now_is_looked_for_again(made: list[Question]) -> None:
    stored.proved_once(image_of(TEXT), REACHES[1], Limits())
    [file] = stored.PROOFS.folder.iterdir()
    content = json.loads(stored.PROOFS.read(file.name) or b"")
    offset = content["run"][1][0][0][0]
    runs = [[[0], []], [[0], [[]]], [[0], [[[offset, 2, 0, 0, 4]]]], [[0], [[[offset, 2, 0, 0, -4]]]],
            [[0], [[[1 << 40, 2, 0, 0, 4]]]],
            [[0], [[[-2, 2, 0, 0, 4]]]], [["x"], [[[offset, 2, 0, 0, 10]]]], [[], []], None, "run"]  # fmt: skip
    for number, run in enumerate(runs):
        stored.PROOFS.write(file.name, json.dumps(content | {"run": run}).encode())
        assert not stored.proved_once(image_of(TEXT), REACHES[1], Limits()).is_kept, run
        assert len(made) == number + 2


def test_a_note_that_names_a_line_is_made_anew_where_lines_have_moved(made: list[Question]) -> None:
    dead = TEXT.replace("b := a;", "b := a;\n    IF a > 10 THEN\n        b := 0;\n    END_IF")
    notes = [stored.proved_once(image_of(text), ASKED, Limits()).notes for text in (dead, dead, "\n" + dead)]
    assert len(made) == 2
    assert [note[0].rpartition(":")[2] for note in notes] == ["8", "8", "9"]
    assert [stored.proved_once(image_of(text), ASKED, Limits()).is_kept for text in (TEXT, "\n" + TEXT)] == [False, True]


@pytest.mark.parametrize("content", [b"", b"nonsense", b"[]", b'{"word": "proved"}', b'{"word": "broken", "how": "", "scans": 1, '
                                     b'"notes": [], "lines": ""}', b'{"word": "proved", "how": 1, "scans": 1, "notes": [], '
                                     b'"lines": ""}'])  # fmt: skip
def test_a_file_that_cannot_be_read_is_no_proof(made: list[Question], content: bytes) -> None:
    stored.proved_once(image_of(TEXT), ASKED, Limits())
    [file] = stored.PROOFS.folder.iterdir()
    whole = file.read_bytes()
    file.write_bytes(whole[:-1])
    assert stored.proved_once(image_of(TEXT), ASKED, Limits()).is_kept is False
    stored.PROOFS.write(file.name, content)
    assert stored.proved_once(image_of(TEXT), ASKED, Limits()).is_kept is False
    assert file.read_bytes() == whole


def test_the_verb_and_tests_keep_their_proofs_together(made: list[Question], tmp_path: Path, plc: RigMaker) -> None:
    file = tmp_path / "main.st"
    file.write_text(TEXT, encoding="utf-8")
    call = ["prove", str(file), "--never", "Main.b > 10", "--json"]
    kept = [json.loads(CliRunner().invoke(main, [*call, *more]).stdout)["properties"][0]["from_cache"]
            for more in ([], [], ["--no-cache"], [])]  # fmt: skip
    assert (kept, len(made)) == ([False, True, False, True], 2)
    assert proved(plc(str(file)), never="Main.b > 10").is_kept
