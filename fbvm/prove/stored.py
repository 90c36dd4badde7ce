"""Proofs that are kept on disk: an image that was proved once is not proved again, as long as nothing of it changes."""

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
from fbvm.prove.prover import Limits, Tell, prove
from fbvm.prove.question import PROVED, UNREACHABLE, WITHIN, WRITTEN_ONCE, Names, Question, Verdict

PROOFS = Cache("proofs", b"fbvm proof 2\n", 4 << 20)
PROOF_WORDS = (PROVED, UNREACHABLE)
"""The verdicts that hold for all scans, whatever the limits of the search were."""


def proved_once(image: Image, question: Question, limits: Limits, tell: Tell = lambda said: None) -> Verdict:
    """The answer to a question; a proof is kept and not made again.  Raises what `prove` raises.

    Another program, property, assumption, lemma or time between scans is another proof; where notes name lines, another line
    is, too."""
    times_ns = [limits.cycle_ns, max(limits.cycle_ns, limits.longest_ns)]
    name = name_of((_methods(), image.fingerprint, _types(image), json.dumps([times_ns, *_asked(image, question)])))
    if (known := _read(name, image, question)) is not None:
        return known
    verdict = prove(image, question, limits, tell)
    if verdict.word in PROOF_WORDS:
        kept = {"word": verdict.word, "how": verdict.how, "scans": verdict.scans, "notes": verdict.notes,
                "lines": _lines(image, verdict.notes)}  # fmt: skip
        PROOFS.write(name, json.dumps(kept).encode())
    return verdict


def _read(name: str, image: Image, question: Question) -> Verdict | None:
    """The proof that is kept under a name; None if there is none, or none that can be read."""
    content = PROOFS.read(name)
    try:
        kept = json.loads(content or b"null")
        word, how, scans, notes, lines = (kept[key] for key in ("word", "how", "scans", "notes", "lines"))
        is_whole = word in PROOF_WORDS and isinstance(how, str) and isinstance(scans, int)
        is_whole = is_whole and all(isinstance(note, str) for note in notes)
        if not is_whole or lines != _lines(image, notes):
            return None
    except (ValueError, TypeError, KeyError):
        return None
    return Verdict(question, word, how, scans, None, (), tuple(notes), is_kept=True)


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
