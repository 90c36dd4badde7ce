"""What terms become when they are made, and between which numbers they lie, beside `terms_kept.txt`.

That they mean the same is shown by test_simplified_terms.py; here it is kept how plain they become, since a proof takes much
longer with terms that are not.  `FBVM_REWRITE=1 pytest` of this file writes it anew: read the difference before you keep it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from itertools import product
from pathlib import Path

from test_simplified_terms import BINARY, WIDE

from fbvm.prove.encoding.term import bounds
from fbvm.prove.encoding.terms import Term, Terms

FILE = Path(__file__).with_name("terms_kept.txt")


def shown(name: str, term: Term) -> str:
    """What was asked for, what it became, and its bounds: as an unsigned number, and as a signed one if that says more."""
    signed = "" if term.width <= 0 or bounds(term, True) == (term.low, term.high) else " or {}..{}".format(*bounds(term, True))
    return f"{name} = {term} in {term.low}..{term.high}{signed}"


def kept() -> Iterator[str]:
    """The lines of the file."""
    terms = Terms()
    x, y, p, q = (terms.variable(name, width) for name, width in (("x", WIDE), ("y", WIDE), ("p", 0), ("q", 0)))
    low, half = terms.extend(terms.extract(x, 0, 2), WIDE, False), terms.extend(terms.extract(x, 1, 3), WIDE, True)
    few = terms.ite(p, terms.constant(WIDE, 3), terms.ite(q, terms.constant(WIDE, 12), terms.constant(WIDE, 0)))
    named = {"x": x, "low": low, "half": half, "few": few}
    numbers = {str(number): terms.constant(WIDE, number) for number in (0, 1, 8, 15)}
    for name, (make, _) in BINARY.items():
        for (one, left), (other, right) in product(named.items(), [*numbers.items(), ("y", y), ("low", low), ("x", x)]):
            yield shown(f"{name} {one} {other}", make(terms, left, right))
            if other in numbers and name[1:] not in ("div", "rem"):
                yield shown(f"{name} {other} {one}", make(terms, right, left))
    more = {"y+5": terms.add(y, terms.constant(WIDE, 5)), "-x": terms.neg(x), "not x": terms.invert(x)}
    for name, term in {**named, **more}.items():
        for made, result in {
            "neg": terms.neg(term), "invert": terms.invert(term), "is_set": terms.is_set(term), "bit 3": terms.bit(term, 3),
            "extract 0 2": terms.extract(term, 0, 2), "extract 2 2": terms.extract(term, 2, 2),
            "extract 1 3": terms.extract(term, 1, 3), "zext 6": terms.extend(term, 6, False),
            "sext 6": terms.extend(term, 6, True), "resized 2": terms.resized(term, 2, True),
            "resized 7": terms.resized(term, 7, False),
            "ite p": terms.ite(p, term, x), "ite not p": terms.ite(terms.not_(p), x, term),
        }.items():  # fmt: skip
            yield shown(f"{made} {name}", result)
    sides = {"p": p, "q": q, "not p": terms.not_(p), "true": terms.true, "false": terms.false, "p and q": terms.and_(p, q),
             "p or q": terms.or_(p, q), "x = 3": terms.eq(x, terms.constant(WIDE, 3)),
             "x = 4": terms.eq(x, terms.constant(WIDE, 4)), "x < 3": terms.less(x, terms.constant(WIDE, 3), False)}  # fmt: skip
    for (one, left), (other, right) in product(sides.items(), sides.items()):
        for made, result in (("and", terms.and_(left, right)), ("or", terms.or_(left, right)), ("xor", terms.xor(left, right)),
                             ("ite x=3", terms.ite(sides["x = 3"], left, right))):  # fmt: skip
            yield shown(f"{made} ({one}) ({other})", result)


def test_terms_become_as_plain_as_they_are_kept() -> None:
    lines = list(kept())
    if os.environ.get("FBVM_REWRITE"):
        FILE.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
    assert lines == FILE.read_text(encoding="utf-8").splitlines()
