"""How a proof that a mutant is equal is asked for, what becomes of each answer, and how the changed block is named."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.campaign.mutation import equivalence
from fbvm.campaign.mutation.equivalence import _renamed, proof_of_equality
from fbvm.campaign.mutation.mutants import Change, Mutant
from fbvm.prove.encoding.execution import Refused
from fbvm.prove.equality import Unlike
from fbvm.prove.prover import SpuriousRun
from fbvm.prove.question import BROKEN, PROVED, REACHED, UNDECIDED, UNREACHABLE
from fbvm.prove.solver import SolverMissing
from fbvm.watch.conditions import ConditionError
from fbvm.watch.paths import UnknownPlace

BLOCK = "FUNCTION_BLOCK Twin VAR_INPUT a : INT; END_VAR VAR_OUTPUT b : INT; END_VAR b := a; END_FUNCTION_BLOCK"
SUM = "FUNCTION Sum : INT VAR_INPUT a : INT; END_VAR Sum := a; IF a > 0 THEN SUM := sum + 1; END_IF END_FUNCTION"
TEXT = f"(* ä *) {BLOCK}\n{SUM}\nPROGRAM Main VAR t : Twin; END_VAR t(a := Sum(a := 1)); END_PROGRAM\n"


def mutant(old: str, new: str, pou: str) -> Mutant:
    start = TEXT.index(old)
    return Mutant(1, "twin.st", 1, Change("X", start, start + len(old), new, pou))


@each_of("old, new, pou, text", [
    ("b := a;", "b := a + 1;", "Twin", BLOCK.replace("Twin", "Twin_as_changed").replace("b := a;", "b := a + 1;") + "\n"),
    ("b := a;", ";", "Twin", BLOCK.replace("Twin", "Twin_as_changed").replace("b := a;", ";") + "\n"),
    ("a > 0", "a < 0", "Sum", SUM.replace("FUNCTION Sum", "FUNCTION Sum_as_changed").replace("Sum := a", "Sum_as_changed := a")
     .replace("SUM := sum", "Sum_as_changed := Sum_as_changed").replace("a > 0", "a < 0") + "\n"),
    ("a := 1", "a := 2", "Main", None), ("b := a;", ";", "Nobody", None)])
def test_a_changed_block_has_another_name_wherever_it_names_itself(old: str, new: str, pou: str, text: str | None) -> None:
    assert _renamed(mutant(old, new, pou), TEXT) == text


class Prover:
    """Stands in for compiler and prover; `error` is raised by the one whose name it is with."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, word: str = PROVED, image: Any = "image", **error: Exception) -> None:
        self.word, self.image, self.error = word, image, error
        self.asked: list[Any] = []
        monkeypatch.setattr(equivalence, "equality", SimpleNamespace(
            pair=self.pair, equality=self.question, PROGRAM="Caller", Unlike=Unlike))
        for name, made in (("compile_sources", self.compile), ("prove", self.prove), ("Limits", lambda *of, **more: (of, more)),
                           ("time_limit", lambda limit_ns: f"within {limit_ns}")):
            monkeypatch.setattr(equivalence, name, made)

    def said(self, name: str, *given: Any) -> None:
        self.asked.append((name, *given))
        if name in self.error:
            raise self.error[name]

    def pair(self, sources: list[Source], names: tuple[str, str], libraries: Any) -> Source:
        self.said("pair", [(source.name, source.text) for source in sources], names, libraries)
        return Source("caller", "calls both")

    def compile(self, sources: list[Source], program: str, libraries: Any, *, runnable: bool) -> Any:
        self.said("compile", [source.name for source in sources], program, libraries, runnable)
        return SimpleNamespace(image=self.image)

    def question(self, image: Any, names: tuple[str, str]) -> str:
        self.said("question", image, names)
        return "question"

    def prove(self, image: Any, question: str, limits: Any) -> Any:
        self.said("prove", image, question, limits)
        return SimpleNamespace(word=self.word, how="by induction")


def proof() -> str:
    return proof_of_equality(mutant("b := a;", "b := a + 0;", "Twin"), TEXT, [Path("lib")], 10, 77)


def test_the_block_and_the_changed_one_are_called_beside_each_other(monkeypatch: pytest.MonkeyPatch) -> None:
    prover, names, libraries = Prover(monkeypatch), ("Twin", "Twin_as_changed"), [Path("lib")]
    assert proof() == "proved by induction"
    changed = BLOCK.replace("Twin", "Twin_as_changed").replace("b := a;", "b := a + 0;") + "\n"
    assert prover.asked == [
        ("pair", [("twin.st", TEXT), ("<changed>", changed)], names, libraries),
        ("compile", ["twin.st", "<changed>", "caller"], "Caller", libraries, True), ("question", "image", names),
        ("prove", "image", "question", ((10,), {"expired": "within 77"}))]


@each_of("word", [BROKEN, REACHED, UNREACHABLE, UNDECIDED])
def test_what_is_not_proved_may_be_found(word: str, monkeypatch: pytest.MonkeyPatch) -> None:
    Prover(monkeypatch, word)
    assert proof() == ""


@pytest.mark.parametrize(("about", "asked"), [
    ({"image": None}, 2), ({"pair": Unlike("no")}, 1), ({"question": UnknownPlace("no")}, 3),
    ({"question": ConditionError("no")}, 3), ({"prove": Refused("no")}, 4),
    ({"prove": SpuriousRun("no")}, 4), ({"prove": SolverMissing()}, 4)])
def test_what_cannot_be_proved_may_be_found(about: dict[str, Any], asked: int, monkeypatch: pytest.MonkeyPatch) -> None:
    prover = Prover(monkeypatch, **about)
    assert proof() == "" and len(prover.asked) == asked


def test_a_program_is_not_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    prover = Prover(monkeypatch)
    assert proof_of_equality(mutant("a := 1", "a := 2", "Main"), TEXT, [], 10, 77) == "" and prover.asked == []
