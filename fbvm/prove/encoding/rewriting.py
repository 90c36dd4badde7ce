"""Terms made again with other leaves, and their values for given leaves."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from fbvm.prove.encoding.terms import Term, Terms


def substituted(terms: Terms, wanted: Iterable[Term], known: dict[Term, Term]) -> list[Term]:
    """The terms with others in place of their variables and unknowns; what is not in `known` stays.

    Everything is simplified as when it was made, so constants are carried through.  `known` is a cache, too: it takes the
    results."""
    found = []
    for term in wanted:
        waiting = [term]
        while waiting:
            at = waiting[-1]
            if at in known:
                waiting.pop()
                continue
            missing = [arg for arg in at.args if arg not in known]
            if missing:
                waiting += missing
                continue
            waiting.pop()
            args = tuple(known[arg] for arg in at.args)
            known[at] = at if args == at.args else terms.again(at, args)
        found.append(known[term])
    return found


def leaves(wanted: Iterable[Term]) -> set[Term]:
    """The variables and unknowns in some terms."""
    seen: set[Term] = set()
    waiting = list(wanted)
    while waiting:
        term = waiting.pop()
        if term not in seen:
            seen.add(term)
            waiting += term.args
    return {term for term in seen if term.op in ("var", "unknown")}


def cone(next_terms: Mapping[Term, Term], wanted: Iterable[Term]) -> set[Term]:
    """The variables of the state that the terms depend on, in this scan or by the scans before."""
    return {*distances(next_terms, wanted)}


def distances(next_terms: Mapping[Term, Term], wanted: Iterable[Term]) -> dict[Term, int]:
    """The variables of the state that the terms depend on, and by how many scans before: the nearest first."""
    found: dict[Term, int] = {}
    waiting, scans = list(wanted), 0
    while waiting:
        new = sorted((leaf for leaf in leaves(waiting) if leaf in next_terms and leaf not in found), key=lambda leaf: leaf.number)
        found.update(dict.fromkeys(new, scans))
        waiting, scans = [next_terms[leaf] for leaf in new], scans + 1
    return found
