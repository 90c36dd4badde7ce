"""Proofs in tests: what a block or a program does for all inputs, in all scans.

    def test_never_up_and_down(fb):
        proved(fb("src/gate.st::Gate"), never="Up AND Down")

Needs the package bitwuzla (the extra `prove`)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from fbvm.base.types import StructType
from fbvm.code.image import Image
from fbvm.prove.cycle import cycle_bounds
from fbvm.prove.encoding.execution import Refused
from fbvm.prove.prover import Limits
from fbvm.prove.question import ALWAYS, NEVER, NO_TRAP, WRITTEN_ONCE, Question, Verdict
from fbvm.prove.report import details, headline
from fbvm.prove.stored import proved_once
from fbvm.run.time_limit import time_limit
from fbvm.testing.rig import Rig


class NotProved(AssertionError):
    """A property is broken, or could not be decided; `verdict` has the run."""

    def __init__(self, message: str, verdict: Verdict) -> None:
        super().__init__(message)
        self.verdict = verdict


def proved(rig: Rig, *, never: str = "", always: str = "", no_trap: bool = False, written_once: str = "",
           assume: str | Sequence[str] = (), free: str | Sequence[str] = (), scans: int = 1000, seconds: float = 60,
           cycle: str = "", unit_rules: Sequence[tuple[int, int]] = (), lemma: str | Sequence[str] = ()) -> Verdict:  # fmt: skip
    """Asserts that a property of the block or program of a rig holds in every run from power-on.

    One of `never`, `always` (conditions, as `until` takes them), `no_trap` and `written_once` (a name, address or range
    of which no bit is written by two statements in one scan) says which.  Inputs of a block or of a program are free in each
    scan; `free` names others.  `assume` are conditions that all runs keep.  `scans` is how far to look where there is no proof,
    `seconds` how long.  `cycle` is the time between two scans, that of the rig unless given:
    `5ms..50ms` lets any time within these bounds pass.  `unit_rules` are unit numbers of ETN21s and sockets, (0, 1), whose words
    change as the manuals say.  `lemma` are conditions that are proved to hold behind every scan, too, and then help the
    proof.  Stubs and units themselves have no part in it.  A proof is kept on disk until the program or the
    property changes.

    Raises NotProved, and ValueError for a program that cannot be followed, for names that it does not have, or without exactly
    one property."""
    __tracebackhide__ = True
    kinds = [(NEVER, never), (ALWAYS, always), (NO_TRAP, "no trap" if no_trap else ""),
             (WRITTEN_ONCE, written_once)]  # fmt: skip
    chosen = [(kind, text) for kind, text in kinds if text]
    if len(chosen) != 1:
        raise ValueError("say what to prove: one of never, always, no_trap and written_once")
    kind, text = chosen[0]
    subject = rig.subject
    named = [free] if isinstance(free, str) else [*free]
    assumed = (assume,) if isinstance(assume, str) else tuple(assume)
    question = Question(kind, "" if kind == NO_TRAP else text, assumed, (*_inputs(subject.image, subject.prefix), *named),
                        subject.prefix, units=tuple(unit_rules),
                        lemmas=(lemma,) if isinstance(lemma, str) else tuple(lemma))  # fmt: skip
    cycle_ns, longest_ns = cycle_bounds(cycle) if cycle else (rig.plc.cycle_ns, 0)
    limits = Limits(cycle_ns, scans, longest_ns=longest_ns, expired=time_limit(int(seconds * 1_000_000_000)))
    try:
        verdict = proved_once(subject.image, question, limits)
    except Refused as refused:
        place = f"{subject.image.sites[refused.site]}: " if refused.site >= 0 else ""
        raise ValueError(f"{place}{refused.reason}") from None
    if not verdict.is_good:
        lines = [headline(verdict), *details(subject.image, verdict)]
        raise NotProved("\n".join(subject.plain(line) for line in lines), verdict)
    return verdict


def _inputs(image: Image, prefix: str) -> Iterator[str]:
    """The names of the inputs of the block under test, which its caller leaves to the test."""
    path = prefix.rstrip(".").split(".")
    symbol = image.symbols.get(path[0].upper())
    kind = symbol.type if symbol else None
    for name in path[1:]:
        member = kind.member(name) if isinstance(kind, StructType) else None
        kind = member.type if member else None
    if isinstance(kind, StructType):
        yield from (field.name for field in kind.fields.values() if field.kind == "VAR_INPUT" and not field.reference)
