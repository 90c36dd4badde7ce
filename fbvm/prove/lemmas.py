"""Lemmas: what somebody who knows the program says of its state behind every scan, so that induction has it to begin with.

A lemma is proved, not assumed: together with the other lemmas and the property, by induction over one scan, and those that a scan
breaks are dropped."""

from __future__ import annotations

from collections.abc import Iterator

from fbvm.prove.copies import Kept
from fbvm.prove.encoding.execution import Refused
from fbvm.prove.encoding.properties import condition_term
from fbvm.prove.encoding.rewriting import leaves
from fbvm.prove.encoding.summary import Summary
from fbvm.prove.encoding.terms import Term
from fbvm.prove.question import ALWAYS, NEVER, REACH, Names, Question
from fbvm.watch.paths import Place


def lemma_places(names: Names, question: Question) -> Iterator[Place]:
    """What the lemmas of a question name.  Raises ConditionError."""
    for text in question.lemmas:
        yield from names.condition(text).places


def lemmas(summary: Summary, names: Names, question: Question) -> dict[Kept, str]:
    """The lemmas of a question as guesses, with their texts; and as others the property and the assumptions, with "".

    Raises Refused for a lemma about inputs."""
    found: dict[Kept, str] = {}
    for text in question.lemmas:
        term = _before(summary, names, text)
        if not _is_state(summary, term):
            raise Refused(f"the lemma {text} is about inputs, which have any value: a lemma is about what the program keeps")
        found[Kept(summary.terms.not_(term))] = text
    for text in question.assumptions:
        if _is_state(summary, term := _before(summary, names, text)):
            found.setdefault(Kept(summary.terms.not_(term)), "")
    if question.kind in (NEVER, ALWAYS, REACH) and _is_state(summary, term := _before(summary, names, question.text)):
        found.setdefault(Kept(summary.terms.not_(term) if question.kind == ALWAYS else term), "")
    return found


def _before(summary: Summary, names: Names, text: str) -> Term:
    """A condition about the state before a scan."""
    return condition_term(summary.before, names.condition(text).term)


def _is_state(summary: Summary, term: Term) -> bool:
    return leaves([term]) <= summary.cells.keys()
