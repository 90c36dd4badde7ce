"""Alias scopes: metadata by which LLVM knows that two accesses of a body never touch the same byte.

LLVM then keeps a value in a register across a store elsewhere.  That two constant addresses of one base differ LLVM sees by
itself.  The metadata says which range a computed subscript can reach, that an instance lies apart from the areas, and that
no variable lies among the words of the system page.  See the LLVM Language Reference on `noalias` and `alias.scope`."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field

from fbvm.base.areas import PAGE_BYTES
from fbvm.code.operations import Address
from fbvm.engine.native.emit.call_graph import Range, reached
from fbvm.engine.ranges import RangeOf, value_range

Access = tuple[bool, int, int, bool]
"""Whether its address counts from the instance (else from the start of memory), first byte, the byte behind the last, whether
the address is computed from a subscript."""
MOST = 16
"""How many ranges of computed subscripts are told apart in one body."""
SYSTEM = ", !alias.scope !2, !noalias !3"
"""The metadata of accesses to words of the system page."""
METADATA = """\
!0 = !{!"branch_weights", i32 1, i32 4000}
!1 = !{}
!2 = !{!4}
!3 = !{!5}
!4 = distinct !{!4, !6, !"system page"}
!5 = distinct !{!5, !6, !"program"}
!6 = distinct !{!6, !"memory"}
!7 = !{i64 0, i64 -9223372036854775808}
"""
FIRST_NUMBER = 8
"""The first number of the metadata that bodies add."""
_MARK = re.compile(r" ;(\d+)$", re.MULTILINE)
"""A mark at the end of the line of an access: a comment to LLVM, until `resolved` puts metadata in its place."""


@dataclass
class AliasScopes:
    """The accesses of one body.

    `instances` is the range of bytes of the memory in which its instances begin; `base` is where its only instance begins, None
    if there are several; `next` is the number of the next mark (numbers go on from body to body); `range_of` says what
    subscripts can be."""

    instances: Range
    base: int | None
    next: int
    range_of: RangeOf = value_range
    marked: list[tuple[Address, int]] = field(default_factory=list)
    accesses: dict[Access, int] = field(default_factory=dict)

    def is_apart(self, address: Address, count: int) -> bool:
        """True if an access cannot touch the words of the system page."""
        return self._access(address, count) is not None

    def mark(self, address: Address, count: int) -> str:
        """Notes an access of `count` bytes.  Returns the mark for the end of its line."""
        self.marked.append((address, count))
        self.next += 1
        return f" ;{self.next - 1}"

    def _access(self, address: Address, count: int) -> Access | None:
        """What an access can touch; None if that could be words of the system page."""
        low, high = reached(address, count, self.range_of)
        from_instance = address[0] == "self"
        if from_instance and self.base is not None:
            from_instance, low, high = False, low + self.base, high + self.base
        if low + (self.instances[0] if from_instance else 0) < PAGE_BYTES or high > 1 << 40:
            return None
        return from_instance, low, high, bool(address[2])

    def told(self, number: int) -> tuple[list[str], list[str]]:
        """The metadata that each mark stands for, and the definitions of metadata, whose numbers begin with `number`."""
        found = [self._access(*marked) for marked in self.marked]
        places = [None if access is None else self.accesses.setdefault(access, len(self.accesses)) for access in found]
        marks, lines = self._marks(number)
        return ["" if place is None else marks[place] for place in places], lines

    def _marks(self, number: int) -> tuple[list[str], list[str]]:
        """The metadata of each access, and the definitions, whose numbers begin with `number`."""
        groups = self._groups()
        count = max(groups, default=-1) + 1
        if count < 2:
            return [", !alias.scope !3, !noalias !2"] * len(groups), []
        apart = [[other for other in range(count) if other != group and self._apart(groups, group, other)]
                 for group in range(count)]
        lines = [f"!{number} = distinct !{{!{number}}}"]
        lines += [f"!{number + 1 + group} = distinct !{{!{number + 1 + group}, !{number}}}" for group in range(count)]
        at = number + 1 + count
        for group in range(count):
            lines.append(f"!{at + 2 * group} = !{{!5, !{number + 1 + group}}}")
            others = "".join(f", !{number + 1 + other}" for other in apart[group])
            lines.append(f"!{at + 2 * group + 1} = !{{!4{others}}}")
        return [f", !alias.scope !{at + 2 * group}, !noalias !{at + 2 * group + 1}" for group in groups], lines

    def _groups(self) -> list[int]:
        """For each access the number of its group; accesses of two groups that are told apart never touch the same byte.

        There is a group for each run of computed accesses that may meet one another, with the constant accesses that may meet
        one of them; then one for all other constant accesses that count from the start of memory, and one for those that count
        from the instance."""
        runs = self._runs_of_computed()
        self._members: list[list[Access]] = [list(run) for run in runs] + [[], []]
        groups = []
        for access in self.accesses:
            number = self._number_of_run(runs, access)
            group = len(runs) + access[0] if number is None else number
            self._members[group].append(access)
            groups.append(group)
        return groups

    def _runs_of_computed(self) -> list[list[Access]]:
        """Computed accesses, and of those that may meet one another one list; no constant access meets two of the lists."""
        runs: list[list[Access]] = []
        for access in self.accesses:
            if access[3]:
                runs = self._joined(runs, access, [access])
        if len(runs) > MOST:
            runs = [[access for run in runs for access in run]]
        count = -1
        while count != len(runs):  # a list that has grown may meet more
            count = len(runs)
            for access in self.accesses:
                runs = self._joined(runs, access, [])
        return runs

    def _joined(self, runs: list[list[Access]], access: Access, more: list[Access]) -> list[list[Access]]:
        """`runs`, of which those that an access may meet, and `more`, are one."""
        meeting = [run for run in runs if self._meets(access, run)]
        if not more and len(meeting) < 2:
            return runs
        return [run for run in runs if run not in meeting] + [[*more, *(other for run in meeting for other in run)]]

    def _number_of_run(self, runs: list[list[Access]], access: Access) -> int | None:
        """Which of the runs an access may meet; None if it meets none."""
        return next((number for number, run in enumerate(runs) if self._meets(access, run)), None)

    def _meets(self, access: Access, run: list[Access]) -> bool:
        return any(self._meet(access, other) for other in run)

    def _apart(self, groups: list[int], a: int, b: int) -> bool:
        return not any(self._meet(one, other) for one in self._members[a] for other in self._members[b])

    def _meet(self, a: Access, b: Access) -> bool:
        """True if two accesses can touch the same byte."""
        first, second = self._bytes(a, a[0] == b[0]), self._bytes(b, a[0] == b[0])
        return first[0] < second[1] and second[0] < first[1]

    def _bytes(self, access: Access, one_base: bool) -> Range:
        if one_base or not access[0]:
            return access[1], access[2]
        return access[1] + self.instances[0], access[2] + self.instances[1] - 1


def resolved(text: str, bodies: Iterable[AliasScopes]) -> str:
    """The text of a module with metadata in place of the marks of its bodies, which come in their order."""
    marks: list[str] = []
    metadata: list[str] = []
    for regions in bodies:
        told, lines = regions.told(FIRST_NUMBER + len(metadata))
        marks += told
        metadata += lines
    return "\n".join([_MARK.sub(lambda match: marks[int(match[1])], text), *metadata])
