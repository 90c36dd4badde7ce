"""Statements of code over states: stores, and how paths part and come together again.

A block that is executed has up to four outcomes: it goes on behind its end, or leaves the innermost loop, goes to the loop's
tail, or leaves the body.  Each outcome is one state with the condition of its path."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from fbvm.code.image import DISPATCH, Body
from fbvm.code.operations import SIZES, TEXT_UNITS, WHOLE_BYTES, Address, Block, Node, detail_size
from fbvm.engine.inlining import in_place
from fbvm.prove.encoding.addresses import Target, targets
from fbvm.prove.encoding.cells import BIT
from fbvm.prove.encoding.execution import UNWOUND, Attempt, Execution, Held, Refused, Row, State, Trapped
from fbvm.prove.encoding.expressions import is_signed
from fbvm.prove.encoding.terms import Term

MOST_SYMBOLIC_ROUNDS = 260
"""Rounds of a loop of which none is certain."""
FIRST_COMPARED = 64
"""Rounds behind which a loop is suspected of going round for ever; a power of two."""
LEAVES = ("exit", "next", "return")

Outcomes = dict[str, list[State]]
"""States that left the block early, by how they left."""


def run_block(x: Execution, block: Block, state: State) -> tuple[State | None, Outcomes]:
    """Executes a block.  Returns the state behind its end, None if no path gets there, and those that left it."""
    left: Outcomes = {}
    for node in block:
        if node[0] in LEAVES:
            left.setdefault(node[0], []).append(state)
            return None, left
        branch = BRANCHES.get(node[0])
        if branch is None:
            x.statements[node[0]](x, state, *node[1:])
            continue
        x.step()
        following, others = branch(x, state, *node[1:])
        for how, states in others.items():
            left.setdefault(how, []).extend(states)
        if following is None:
            return None, left
        state = following
    return state, left


MOST_CALLS = 32
"""How many nested calls of bodies that are active already are followed."""


def call(x: Execution, state: State, body: Body, base: int) -> State:
    """The state behind a call of a body for the instance at `base`; `state` itself, written."""
    x.calls, x.stored = x.calls + 1, None
    if x.calls > MOST_CALLS + len(x.image.bodies):
        raise Refused(f"calls come back more than {MOST_CALLS} times, which is too deep to be followed", x.site)
    outer_base, outer_temporaries, x.base, state.temporaries = x.base, state.temporaries, base, {}
    outer_site, outer_callers, x.callers = x.site, x.callers, (*x.callers, (x.site, base))
    begun = state.path
    following, left = run_block(x, body.code, state)
    ends = left.get("return", []) + ([following] if following else [])
    x.base, x.stored, x.site, x.callers = outer_base, None, outer_site, outer_callers
    x.calls -= 1
    if not ends:
        raise Refused("a call never ends", x.site)
    last = ends[0] if len(ends) == 1 else _joined(state, ends, x)
    if last is not state:
        state.join([last], [x.terms.true])
    state.path, state.temporaries = begun, outer_temporaries
    return state


def _joined(ancestor: State, states: list[State], x: Execution) -> State:
    """One state of several that exclude each other."""
    path = x.terms.any_of(*(state.path for state in states))
    made = ancestor.child(path)
    made.join(states, [state.path for state in states])
    return made


# --- branches ---------------------------------------------------------------------------------------------------------


def _branches(x: Execution, state: State, tests: Sequence[Callable[[State], Term]],
              blocks: list[Block]) -> tuple[State | None, Outcomes]:  # fmt: skip
    """The block of the first test that is TRUE, else the last block."""
    terms, left = x.terms, dict[str, list[State]]()
    path, rest = state.path, terms.true
    ends: list[tuple[State, Term]] = []
    complete = True
    for number, block in enumerate(blocks):
        condition = terms.true
        if number < len(tests):
            state.path = terms.and_(path, rest)
            condition = tests[number](state)
        taken = terms.and_(rest, condition)
        if taken is terms.true:  # nothing is left to choose
            state.path = path
            return run_block(x, block, state)
        rest = terms.and_(rest, terms.not_(condition))
        if terms.and_(path, taken) is terms.false:
            continue
        begun = terms.and_(path, taken)
        following, others = run_block(x, block, state.child(begun))
        for how, states in others.items():
            left.setdefault(how, []).extend(states)
        if following is not None:
            ends.append((following, taken))
        complete = complete and following is not None and following.path is begun
    state.path = path
    if not ends:
        return None, left
    if complete and not left:
        state.join([end for end, _ in ends], [taken for _, taken in ends])
        return state, left
    conditions = [taken if complete else end.path for end, taken in ends]
    made = state.child(path if complete else terms.any_of(*(end.path for end, _ in ends)))
    made.join([end for end, _ in ends], conditions)
    return made, left


def _if(x: Execution, state: State, rows: tuple[tuple[Node, Block], ...], otherwise: Block) -> tuple[State | None, Outcomes]:
    tests = [partial(_value, x, node) for node, _ in rows]
    return _branches(x, state, tests, [*(block for _, block in rows), otherwise])


def _case(x: Execution, state: State, machine: str, a: Node, rows: tuple[tuple[Any, Block], ...],
          otherwise: Block) -> tuple[State | None, Outcomes]:  # fmt: skip
    value = x.value(state, a)
    tests = [partial(_fitting, x, value, machine, labels) for labels, _ in rows]
    return _branches(x, state, tests, [*(block for _, block in rows), otherwise])


def _value(x: Execution, node: Node, state: State) -> Term:
    return x.value(state, node)


def _fitting(x: Execution, value: Term, machine: str, labels: Any, state: State) -> Term:
    """Whether one of the labels of a CASE fits a value."""
    return x.terms.any_of(*(_labelled(x, value, machine, low, high) for low, high in labels))


def _labelled(x: Execution, value: Term, machine: str, low: Any, high: Any) -> Term:
    least, greatest = (x.terms.constant(value.width, int(label)) for label in (low, high))
    if low == high:
        return x.terms.eq(value, least)
    sign = is_signed(machine)
    return x.terms.and_(x.terms.less(least, value, sign, True), x.terms.less(value, greatest, sign, True))


def _loop(x: Execution, state: State, head: Block, body: Block, tail: Block) -> tuple[State | None, Outcomes]:
    """Follows a loop round by round, until no path goes on.

    One that comes back to a state in which it was never ends, so it uses up the budget; the state behind a power of two of
    rounds is compared with those up to the next power, which finds a cycle of any length (Brent 1980)."""
    ends: list[State] = []
    returned: list[State] = []
    begun, site, rounds, count, at = state.path, x.site, 0, 0, state
    seen: Held | None = None
    while True:
        following, left = run_block(x, head + body, at)
        ends += left.get("exit", [])
        returned += left.get("return", [])
        waiting = left.get("next", []) + ([following] if following else [])
        if not waiting:
            break
        following = waiting[0] if len(waiting) == 1 else _joined(at, waiting, x)
        following, left = run_block(x, tail, following)
        ends += left.get("exit", [])
        returned += left.get("return", [])
        if following is None or following.path is x.terms.false:
            break
        rounds += following.path is not begun
        x.rounds_most = max(x.rounds_most, rounds)
        if rounds > MOST_SYMBOLIC_ROUNDS:
            x.trap(following, x.terms.true, UNWOUND, site)
            break
        x.step()
        at = following  # one of its own if a path has left
        count += 1
        if count >= FIRST_COMPARED and count & count - 1 == 0:
            seen = at.held()
        elif seen is not None and at.is_again(seen):
            x.trap(at, x.terms.true, "R0104", site)
            break
    others: Outcomes = {"return": returned} if returned else {}
    if not ends:
        return None, others
    made = ends[0] if len(ends) == 1 else _joined(state, ends, x)
    if not returned:  # whoever began the loop is here, or has trapped
        made.path = begun
    return made, others


BRANCHES: dict[str, Callable[..., tuple[State | None, Outcomes]]] = {"if": _if, "case": _case, "loop": _loop}


# --- stores -----------------------------------------------------------------------------------------------------------


def _stored(x: Execution, state: State, address: Address, size: int) -> list[Target]:
    """The places that a store writes, kept for the observation behind it."""
    found = targets(x, state, address, size)
    x.stored = address, found
    return found


def _store(x: Execution, state: State, machine: str, address: Address, a: Node) -> None:
    size = SIZES[machine]
    found = _stored(x, state, address, size)
    value = x.value(state, a)
    for target in found:
        if machine == "b":
            state.contents.write_boolean(target.offset, value, target.condition)
        else:
            state.contents.write(target.offset, size, value, target.condition)


def _store_bit(x: Execution, state: State, address: Address, bit: int, a: Node) -> None:
    found = _stored(x, state, address, 1)
    value = x.value(state, a)
    for target in found:
        state.contents.write_bit(target.offset, bit, value, target.condition)


def _store_flag(x: Execution, state: State, address: Address, a: Node) -> None:
    found = _stored(x, state, address, 1)
    value = x.value(state, a)
    for target in found:
        if target.bit == WHOLE_BYTES:
            state.contents.write_boolean(target.offset, value, target.condition)
        else:
            state.contents.write_bit(target.offset, target.bit & 7, value, target.condition)


def _store_text(x: Execution, state: State, address: Address, capacity: int, a: Node) -> None:
    unit = TEXT_UNITS[a[1]]
    found = _stored(x, state, address, (capacity + 1) * unit)
    value = x.value(state, a)
    for target in found:
        if value.is_constant:
            codes = [*(value.value if isinstance(value.value, bytes) else map(ord, value.value))][:capacity]
            for at, code in enumerate([*codes, 0]):
                state.contents.write(target.offset + unit * at, unit, x.terms.constant(8 * unit, code), target.condition)
            continue
        for at in range(capacity + 1):
            old = state.contents.number(target.offset + unit * at, unit)
            new = x.terms.unknown(("unit", at, capacity, unit), 8 * unit, value, old)
            state.contents.write(target.offset + unit * at, unit, new, target.condition)


def _copy(x: Execution, state: State, to: Address, source: Address, size: int) -> None:
    into, origins = _stored(x, state, to, size), targets(x, state, source, size)
    if len(into) == 1 and len(origins) == 1:
        state.contents.copy(into[0].offset, origins[0].offset, size, x.terms.true)
        return
    if len(into) * len(origins) * size > 1 << 16:
        raise Refused("a copy chooses from too many places", x.site)
    for target in into:
        for origin in origins:
            guard = x.terms.and_(target.condition, origin.condition)
            for at, value in [(at, state.contents.number(origin.offset + at, 1)) for at in range(size)]:
                state.contents.write(target.offset + at, 1, value, guard)


def _fill(x: Execution, state: State, address: Address, pattern: bytes) -> None:
    for target in _stored(x, state, address, len(pattern)):
        partition = state.contents.partition
        for cell in partition.covering(target.offset, len(pattern)):
            first = cell.offset - target.offset
            if first < 0 or first + cell.size > len(pattern):
                for at in range(max(first, 0), min(first + cell.size, len(pattern))):
                    state.contents.write(target.offset + at, 1, x.terms.constant(8, pattern[at]), target.condition)
                continue
            number = int.from_bytes(pattern[first : first + cell.size], "little")
            if cell.width:
                state.contents.write(cell.offset, cell.size, x.terms.constant(cell.width, number), target.condition)
            elif cell.kind == BIT:
                state.contents.write_bit(cell.offset, cell.bit, x.terms.boolean(number >> cell.bit & 1), target.condition)
            else:
                state.contents.write(cell.offset, 1, x.terms.constant(8, number), target.condition)


def _reverse(x: Execution, state: State, address: Address, size: int, runs: tuple[tuple[int, ...], ...]) -> None:
    for target in _stored(x, state, address, size):
        for offset, count, stride, item in runs:
            for start in range(target.offset + offset, target.offset + offset + count * stride, stride):
                parts = [state.contents.number(start + at, 1) for at in range(item)]
                for at, part in enumerate(reversed(parts)):
                    state.contents.write(start + at, 1, part, target.condition)


def _let(x: Execution, state: State, number: int, machine: str, a: Node) -> None:
    state.temporaries[number] = x.value(state, a)


# --- the rest ---------------------------------------------------------------------------------------------------------


def _call(x: Execution, state: State, pou: int, address: Address | None) -> None:
    body = x.image.bodies[pou]
    if body.kind == DISPATCH:
        following, _ = run_block(x, in_place(body.code, address), state)
        if following is None:
            raise Refused("a call never ends", x.site)
        if following is not state:
            state.join([following], [x.terms.true])
        return
    if address is None:
        call(x, state, body, 0)
        return
    found = targets(x, state, address, max(1, body.instance_size))
    if len(found) == 1 and found[0].condition is x.terms.true:
        call(x, state, body, found[0].offset)
        return
    path = state.path
    for target in found:  # one of them is executed
        inner = state.child(x.terms.and_(path, target.condition))
        call(x, inner, body, target.offset)
        state.join([inner, state.child(path)], [target.condition, x.terms.not_(target.condition)])
    state.path = path


def _attempt(x: Execution, state: State, pou: int, address: Address | None, number: int, traps: bool) -> None:
    """The body of an attempt is a part of this one, for the same instance."""
    attempt, inner = Attempt(traps, state.contents), state.child(state.path)
    outer = x.base, x.site, x.callers, x.calls
    x.attempts.append(attempt)
    end: State | None = None
    try:
        end = call(x, inner, x.image.bodies[pou], x.base if address else 0)
    except Trapped:
        if not attempt.is_certain:
            state.join([inner], [x.terms.true])  # the memory as the trap has found it
            raise
        x.base, x.site, x.callers, x.calls = outer
    finally:
        x.attempts.pop()
    attempt.join(state, number, end)


def _charge(x: Execution, state: State, count: int, site: int) -> None:
    x.step()
    state.used += count
    if state.used > x.budget:
        if state.path is x.terms.true:
            x.trap(state, x.terms.true, "R0104", site)
        x.trap(state, x.terms.true, UNWOUND, site)


def _stop(x: Execution, state: State, code: str, site: int) -> None:
    x.trap(state, x.terms.true, code, site)


def _raise(x: Execution, state: State, a: Node, site: int) -> None:
    x.trap(state, x.terms.true, "R0122", site, x.value(state, a))


def _due(x: Execution, state: State, a: Node) -> None:
    """A note for who waits; what it evaluates has no effect."""


def _observe(x: Execution, state: State, kind: str, site: int, detail: Any) -> None:
    if kind in ("statement", "rung"):
        x.site = site
        x.reached[site] = x.terms.or_(x.reached.get(site, x.terms.false), state.path)
    elif kind == "write" and x.writes.watched:
        _note_write(x, state, site, *detail)


def _note_write(x: Execution, state: State, site: int, form: str | tuple[str, int], address: Address, bit: int) -> None:
    """Notes who has written, as the engine tells it: where the store went whose subscripts it may have changed."""
    size = detail_size(form) if bit == WHOLE_BYTES else 1
    found = x.stored[1] if x.stored and x.stored[0] == address else targets(x, state, address, size)
    x.stored = None
    for target in found:
        named = target.bit if form == "b" and bit == WHOLE_BYTES else bit
        x.writes.note((*x.callers, (site, 0)), target.offset, size, named, x.terms.and_(state.path, target.condition))


STATEMENT_ROWS: dict[str, Row] = {
    "store": _store, "store_raw": _store, "store_bit": _store_bit, "store_flag": _store_flag, "store_text": _store_text,
    "copy": _copy, "fill": _fill, "reverse": _reverse, "let": _let, "call": _call, "attempt": _attempt, "charge": _charge,
    "stop": _stop, "raise": _raise, "due": _due, "observe": _observe,
}  # fmt: skip
"""How each statement that does not part paths changes a state: called with the operands of its row."""
