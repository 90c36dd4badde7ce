"""The solver: bitwuzla, asked in terms.  It is imported only when somebody asks.

Bitwuzla is a solver for bit-vectors by A. Niemetz and M. Preiner, under the MIT licence (https://bitwuzla.github.io)."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from fbvm.prove.encoding.terms import Term

SAT, UNSAT, UNKNOWN = "sat", "unsat", "unknown"
HOW_TO_INSTALL = "proofs need the solver bitwuzla: install it by pip install 'fbvm[prove]'"


class SolverMissing(Exception):
    """The package bitwuzla is not installed; the message says how to."""

    def __init__(self) -> None:
        super().__init__(HOW_TO_INSTALL)


class Solver:
    """Asserted terms, and questions whether they can be true together.

    `expired` is asked now and then while a question is open: True ends it, and the answer is UNKNOWN.  Raises SolverMissing."""

    def __init__(self, expired: Callable[[], bool] = lambda: False) -> None:
        try:
            self._api: Any = importlib.import_module("bitwuzla")
        except ImportError:
            raise SolverMissing from None
        self._manager = self._api.TermManager()
        options = self._api.Options()
        options.set(self._api.Option.PRODUCE_MODELS, True)
        self._solver = self._api.Bitwuzla(self._manager, options)
        self._expired, self._interrupt = expired, False
        terminator = self._terminator()
        next(terminator)
        self._solver.configure_terminator(terminator.__next__)
        self._made: dict[Term, Any] = {}
        self._names = 0
        self.questions = 0

    def _terminator(self) -> Iterator[bool]:
        """Whether the solver has to stop, which asks now and then; an exception would not get through it.

        Python handles a signal where its code goes on: in a function before the first `try`, in a generator inside of it."""
        is_over = False
        while True:
            try:
                yield is_over
                is_over = self._expired()
            except KeyboardInterrupt:
                self._interrupt = is_over = True

    def assume(self, *terms: Term) -> None:
        """Asserts terms for good."""
        for term in terms:
            self._solver.assert_formula(self._translated(term))

    def ask(self, *terms: Term) -> str:
        """SAT if what is asserted and these terms can be true together, UNSAT if not, UNKNOWN if the time is over."""
        self.questions += 1
        answer = self._solver.check_sat(*(self._translated(term) for term in terms))
        if self._interrupt:
            raise KeyboardInterrupt
        return {self._api.Result.SAT: SAT, self._api.Result.UNSAT: UNSAT}.get(answer, UNKNOWN)

    def values(self, terms: Iterable[Term]) -> dict[Term, int]:
        """Values of terms in the model of the last question, which was answered by SAT."""
        found = {}
        for term in terms:
            value = self._solver.get_value(self._translated(term))
            found[term] = int(value.value()) if term.width == 0 else int(value.value(10))
        return found

    def _translated(self, term: Term) -> Any:
        waiting = [term]
        while waiting:
            at = waiting[-1]
            if at in self._made:
                waiting.pop()
                continue
            if at.op != "unknown" and (missing := [arg for arg in at.args if arg not in self._made]):
                waiting += missing
                continue
            waiting.pop()
            self._made[at] = self._one(at)
        return self._made[term]

    def _one(self, term: Term) -> Any:
        manager, kinds = self._manager, self._api.Kind
        sort = manager.mk_bv_sort(term.width) if term.width > 0 else manager.mk_bool_sort()
        if term.op == "const":
            if term.width == 0:
                return manager.mk_true() if term.value else manager.mk_false()
            return manager.mk_bv_value(sort, term.value)
        if term.op in ("var", "unknown"):
            self._names += 1
            return manager.mk_const(sort, f"v{self._names}")
        args = [self._made[arg] for arg in term.args]
        if term.op == "extract":
            return manager.mk_term(kinds.BV_EXTRACT, args, [term.value + term.width - 1, term.value])
        if term.op in ("zext", "sext"):
            kind = kinds.BV_ZERO_EXTEND if term.op == "zext" else kinds.BV_SIGN_EXTEND
            return manager.mk_term(kind, args, [term.width - term.args[0].width])
        return manager.mk_term(getattr(kinds, _KINDS[term.op]), args)


_KINDS = {
    "not": "NOT", "and": "AND", "xor": "XOR", "ite": "ITE", "eq": "EQUAL", "ult": "BV_ULT", "ule": "BV_ULE", "slt": "BV_SLT",
    "sle": "BV_SLE", "add": "BV_ADD", "sub": "BV_SUB", "neg": "BV_NEG", "mul": "BV_MUL", "udiv": "BV_UDIV", "urem": "BV_UREM",
    "sdiv": "BV_SDIV", "srem": "BV_SREM", "bvand": "BV_AND", "bvor": "BV_OR", "bvxor": "BV_XOR", "bvnot": "BV_NOT",
    "shl": "BV_SHL", "shr": "BV_SHR", "concat": "BV_CONCAT",
}  # fmt: skip
"""The operations as bitwuzla calls them."""
