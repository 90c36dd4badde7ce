"""The property of what a variable is copied from: a block that hands on the outputs of a block inside keeps what that one keeps.

Where a scan leaves in `v` what it leaves in `w`, or what was there, a property of `v` holds by induction only together with
that of `w`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fbvm.prove.encoding.rewriting import leaves, substituted
from fbvm.prove.encoding.summary import Summary
from fbvm.prove.encoding.terms import Term, Terms
from fbvm.prove.invariants import Sample

MOST_LEVELS = 4
"""How often what was copied is a copy itself."""


@dataclass(frozen=True)
class Kept:
    """A condition over the state that never becomes TRUE."""

    condition: Term

    def term(self, terms: Terms, state: dict[Term, Term], now: Term) -> Term:
        return terms.not_(substituted(terms, [self.condition], dict(state))[0])

    def holds(self, sample: Sample) -> bool:
        """True unless the values of a sample make the condition TRUE: those that it has are no constants of these terms."""
        return not _value(self.condition, sample.values)


def copied(summary: Summary, hit: Term) -> Iterator[Kept]:
    """The conditions of what the variables of a property are copied from; `hit` is that of the property, behind a scan."""
    behind = {term: variable for variable, term in summary.next.items() if not term.is_constant and variable in summary.cells}
    [condition] = substituted(summary.terms, [hit], dict(behind))
    owners, found, seen = _owners(summary), {condition}, set[Term]()
    for _ in range(MOST_LEVELS):
        variables = leaves([condition])
        if not variables or not variables <= summary.cells.keys():
            return
        seen |= variables  # whose copies are not gone back to, if there is another way
        known = {variable: _source(summary, owners, variable, seen) for variable in variables}
        if all(source is variable for variable, source in known.items()):
            return
        [condition] = substituted(summary.terms, [condition], known)
        if condition in found:
            return
        found.add(condition)
        yield Kept(condition)


def _ways(term: Term) -> Iterator[Term]:
    """What a term may be, the whole first, then what stands behind the conditions in it; no constants, no variables."""
    waiting, seen = [term], {term}
    for at in waiting:
        if at.op not in ("const", "var", "unknown"):
            yield at
        if at.op == "ite":
            fresh = [way for way in at.args[1:] if way not in seen]
            seen.update(fresh)
            waiting += fresh


def _owners(summary: Summary) -> dict[Term, list[Term]]:
    """For each term the variables in which a scan may leave it."""
    owners: dict[Term, list[Term]] = {}
    for variable in summary.cells:
        for way in _ways(summary.next[variable]):
            owners.setdefault(way, []).append(variable)
    return owners


def _source(summary: Summary, owners: dict[Term, list[Term]], variable: Term, seen: set[Term]) -> Term:
    """Another variable in which a scan may leave the same, if possible one that was not seen; the variable itself if there is
    none."""
    others = [owner for way in _ways(summary.next[variable]) for owner in owners[way]
              if owner is not variable and owner.width == variable.width]  # fmt: skip
    return next((owner for owner in others if owner not in seen), others[0] if others else variable)


def _value(condition: Term, values: dict[Term, int]) -> int:
    """What a term comes to for values of its variables."""
    terms = Terms()
    made: dict[Term, Term] = {}
    waiting = [condition]
    while waiting:
        at = waiting[-1]
        if missing := [arg for arg in at.args if arg not in made]:
            waiting += missing
            continue
        waiting.pop()
        if at.op == "const":
            made[at] = terms.constant(at.width, at.value)
        elif at.op == "var":
            made[at] = terms.constant(at.width, values[at])
        else:
            made[at] = terms.again(at, tuple(made[arg] for arg in at.args))
    return int(made[condition].value)
