"""A state machine for Hypothesis that drives a block with random inputs, restarts and a random peer.

    TestPump = block_machine(lambda: Rig.of("src/pump.st::Pump"), always=[not_running_before_50_ms])

Needs the package hypothesis.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any
from unittest import TestCase

from hypothesis import note
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from fbvm.net.faults import Fault
from fbvm.testing.rig import Rig
from fbvm.testing.strategies import delays, inputs

MS = 1_000_000


def faults() -> st.SearchStrategy[list[Fault]]:
    """Faults of the network to a peer: none, latency, segments, silence, refusal."""
    row = st.one_of(
        st.builds(Fault, latency_ns=st.integers(0, 3000).map(lambda ms: ms * MS)),
        st.builds(Fault, segment_bytes=st.integers(1, 20), random_cut=st.booleans()),
        st.just(Fault(silent=True)),
        st.just(Fault(error="ECONNREFUSED")),
    )
    return st.lists(row, max_size=1)


class _LazyReport:
    """The report of a rig, which is made when Hypothesis prints the failure."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig

    def __repr__(self) -> str:
        return self._rig.explain() or repr(self._rig)


def block_machine(make: Callable[[], Rig], always: Sequence[Callable[[Rig], object]] = (), longest: str = "1s",
                  **chosen: st.SearchStrategy[Any]) -> type[TestCase]:  # fmt: skip
    """A test case that drives a rig: inputs at random, time passing, power off and on, and faults of its network.

    Each function of `always` is called after every step and fails the test by an assertion, or by returning False.
    `chosen` are strategies of inputs by name.  A trap fails the test, too."""
    wanted = inputs(make(), **chosen)

    class Machine(RuleBasedStateMachine):
        rig: Rig

        @initialize()
        def power(self) -> None:
            self.rig = make()

        @rule(written=wanted)
        def scan(self, written: dict[str, Any]) -> None:
            self.rig.scan(written)

        @rule(time_ns=delays(longest))
        def wait(self, time_ns: int) -> None:
            self.rig.run(time_ns)

        @rule()
        def power_off_and_on(self) -> None:
            self.rig.power_on()

        @rule(rows=faults())
        def change_faults(self, rows: list[Fault]) -> None:
            self.rig.network.faults[:] = rows

        @invariant()
        def holds(self) -> None:
            rig: Rig | None = getattr(self, "rig", None)
            for condition in always if rig else ():
                assert rig is not None
                try:
                    assert condition(rig) is not False, f"{getattr(condition, '__name__', condition)} does not hold"
                except AssertionError:
                    note(_LazyReport(rig))
                    raise

    case: type[TestCase] = Machine.TestCase
    return case
