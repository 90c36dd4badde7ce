"""Answers that are kept on disk: what was proved of an image, or found in it, once is not looked for again, as long as nothing of
it changes."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from functools import cache as once
from typing import Any

from fbvm.base.cache import Cache, name_of, state_of
from fbvm.base.data import PACKAGE
from fbvm.code.image import Image
from fbvm.code.store.encoding import encode
from fbvm.machine.plc import STEP_BUDGET
from fbvm.prove.bounded import Inputs
from fbvm.prove.encoding.cells import Cell
from fbvm.prove.prover import Limits, Tell, prove
from fbvm.prove.question import (
    BROKEN,
    PROVED,
    REACHED,
    UNREACHABLE,
    WITHIN,
    WRITTEN_ONCE,
    Names,
    Question,
    Run,
    Verdict,
)
from fbvm.prove.runs import Judge, Machine, inputs_of, replayed

PROOFS = Cache("proofs", b"fbvm proof 3\n", 4 << 20)
PROOF_WORDS = (PROVED, UNREACHABLE)
"""The verdicts that hold for all scans, whatever the limits of the search were."""
RUN_WORDS = (REACHED, BROKEN)
"""The verdicts about a run.  It is kept if no shorter one does it, and done again on the engine before it is believed."""


def proved_once(image: Image, question: Question, limits: Limits, tell: Tell = lambda said: None) -> Verdict:
    """The answer to a question; a proof, or the shortest run that answers it, is kept and not looked for again.  Raises what
    `prove` raises.

    Another program, property, assumption, lemma or time between scans is another answer; where notes name lines, another line
    is, too."""
    times_ns = [limits.cycle_ns, max(limits.cycle_ns, limits.longest_ns)]
    name = name_of((_methods(), image.fingerprint, _types(image), json.dumps([times_ns, *_asked(image, question)])))
    machine = Machine(image, limits.cycle_ns, times_ns[1], STEP_BUDGET)
    if (known := _read(name, machine, question)) is not None:
        return known
    verdict = prove(image, question, limits, tell)
    if verdict.word in PROOF_WORDS or verdict.run and verdict.run.is_shortest:
        kept = {"word": verdict.word, "how": verdict.how, "scans": verdict.scans, "notes": verdict.notes,
                "lines": _lines(image, verdict.notes), "run": _packed(machine, verdict.run)}  # fmt: skip
        PROOFS.write(name, json.dumps(kept).encode())
    return verdict


def _read(name: str, machine: Machine, question: Question) -> Verdict | None:
    """The answer that is kept under a name; None if there is none, or none that can be read."""
    content = PROOFS.read(name)
    try:
        kept = json.loads(content or b"null")
        word, how, scans, notes, lines = (kept[key] for key in ("word", "how", "scans", "notes", "lines"))
        is_whole = word in (*PROOF_WORDS, *RUN_WORDS) and isinstance(how, str) and isinstance(scans, int)
        is_whole = is_whole and all(isinstance(note, str) for note in notes)
        if not is_whole or lines != _lines(machine.image, notes):
            return None
        judge = Judge.of(machine.image, question)
        run = _again(machine, judge, kept["run"]) if word in RUN_WORDS else None
    except (ValueError, TypeError, KeyError, IndexError, OverflowError):
        return None
    if word in RUN_WORDS and run is None:
        return None
    return Verdict(question, word, how, scans, run, judge.places, tuple(notes), is_kept=True)


def _packed(machine: Machine, run: Run | None) -> list[Any]:
    """A run as plain data: the times of its scans, and the cells that are written before each, with their values."""
    if run is None:
        return []
    inputs = inputs_of(machine, run)
    return [inputs.times_ns, [[[*cell, value] for cell, value in now.items()] for now in inputs.values]]


def _again(machine: Machine, judge: Judge, packed: list[Any]) -> Run | None:
    """A run that was kept, done again; None if it does not do what it did.  Raises ValueError, TypeError, IndexError and
    OverflowError for what is none."""
    times_ns, written = packed
    values = [{Cell(*map(int, numbers[:-1])): int(numbers[-1]) for numbers in now} for now in written]
    if any(cell.offset < 0 or cell.size < 1 for now in values for cell in now):
        return None
    return replayed(machine, judge, Inputs(values, [*map(int, times_ns)]), True)


@once
def _methods() -> str:
    """What changes when a proof could come out otherwise: the encoder and the operations that it reads."""
    return state_of(PACKAGE / "prove", PACKAGE / "code", PACKAGE / "watch", PACKAGE / "units" / "etn21")


def _types(image: Image) -> str:
    """Names and types: the limits of a subrange and the members of an enumeration say what an input may be."""
    return encode(replace(image, bodies=(), sites=(), rungs=(), charts=(), frames={})).decode("utf-8", "surrogatepass")


def _lines(image: Image, notes: Sequence[str]) -> str:
    """The lines of the program, of which some are named by notes; "" if none is."""
    files = {site.file for site in image.sites}
    return name_of(map(repr, image.sites)) if any(file in note for note in notes for file in files) else ""


def _asked(image: Image, question: Question) -> list[Any]:
    """What is asked, as plain data that is the same in every process, with the places that its names have in this image.

    Raises ConditionError and UnknownPlace."""
    names, is_written = Names(image, question.prefix), question.kind == WRITTEN_ONCE
    conditions = [*([question.text] if question.text and not is_written else []), *question.assumptions, *question.lemmas]
    conditions += [question.trigger] if question.kind == WITHIN else []
    places = [place for text in conditions for place in names.condition(text).places]
    places += names.places(question.text) if is_written else ()
    return [question.kind, question.text, question.assumptions, question.lemmas, question.trigger, question.within_ns,
            question.units, [(place.name, str(place.type), place.offset, place.bit, place.hops) for place in places],
            [names.extents(name) for name in question.free]]  # fmt: skip
