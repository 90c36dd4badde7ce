"""Proofs that are kept on disk: an image that was proved once is not proved again, as long as nothing of it changes."""

from __future__ import annotations

import json
from functools import cache as once

from fbvm.base.cache import Cache, name_of, state_of
from fbvm.base.data import PACKAGE
from fbvm.code.image import Image
from fbvm.prove.prover import Limits, prove
from fbvm.prove.question import PROVED, WRITTEN_ONCE, Names, Question, Verdict

PROOFS = Cache("proofs", b"fbvm proof 1\n", 4 << 20)


def proved_once(image: Image, question: Question, limits: Limits) -> Verdict:
    """The answer to a question; a proof is kept and not made again.  Raises what `prove` raises."""
    name = name_of((_methods(), image.fingerprint, str(limits.cycle_ns), str(limits.longest_ns), *_asked(image, question)))
    if (known := PROOFS.read(name)) is not None:
        found = json.loads(known)
        return Verdict(question, PROVED, found["how"], found["scans"], None, (), tuple(found["notes"]))
    verdict = prove(image, question, limits)
    if verdict.word == PROVED:
        kept = {"how": verdict.how, "scans": verdict.scans, "notes": verdict.notes}
        PROOFS.write(name, json.dumps(kept).encode())
    return verdict


@once
def _methods() -> str:
    """What changes when a proof could come out otherwise: the encoder and the operations that it reads."""
    return state_of(PACKAGE / "prove", PACKAGE / "prove" / "encoding", PACKAGE / "code")


def _asked(image: Image, question: Question) -> list[str]:
    """The question in texts: with the places that its names have in this image."""
    names = Names(image, question.prefix)
    written = question.kind == WRITTEN_ONCE
    texts = [*([question.text] if question.text and not written else []), *question.assumptions]
    places = [repr(names.condition(text).places) for text in texts]
    places += [repr(names.places(question.text))] if written else []
    return [question.kind, repr(question.units), *texts, *places, *(repr(names.extents(name)) for name in question.free)]
