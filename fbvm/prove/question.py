"""What is asked of a program, and the answer."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

from fbvm.base.types import AnyType, ArrayType, OpenArrayType, RefType, StringType, StructType, Type
from fbvm.code.image import Image
from fbvm.engine.trap import Trap
from fbvm.watch.conditions import Condition, parse_condition
from fbvm.watch.paths import Place, Span, UnknownPlace, find
from fbvm.watch.scopes import Scope
from fbvm.watch.values import Value, show_time

NEVER, ALWAYS, REACH, NO_TRAP, WITHIN, WRITTEN_ONCE = "never", "always", "reach", "no trap", "within", "written once"

PROVED, BROKEN, REACHED, UNREACHABLE, UNDECIDED = "proved", "broken", "reached", "unreachable", "undecided"


@dataclass(frozen=True)
class Question:
    """A property: `kind` is NEVER, ALWAYS, REACH (of `text`, a condition behind a scan), NO_TRAP, WITHIN or WRITTEN_ONCE.

    WITHIN: when the condition `trigger` becomes TRUE, `text` holds behind that scan or one that begins `within_ns` later at most.
    WRITTEN_ONCE: in no scan two statements write the same bit of `text`, a name, an address or a range.

    Each of `assumptions` holds behind each scan that is looked at; `free` are names and addresses that are inputs, besides those
    that `summary.input_places` finds."""

    kind: str
    text: str = ""
    assumptions: tuple[str, ...] = ()
    free: tuple[str, ...] = ()
    prefix: str = ""
    """The path of an instance, with a dot, whose variables are named without it."""
    title: str = ""
    """What is asked, in words, where the condition is too long."""
    trigger: str = ""
    within_ns: int = 0
    units: tuple[tuple[int, int], ...] = ()
    """Numbers of ETN21s and of sockets, whose words the unit changes by the rules of `unit_rules`."""
    lemmas: tuple[str, ...] = ()
    """Conditions that hold behind every scan, too, which is proved with the property: induction begins with them."""

    def __str__(self) -> str:
        if self.title:
            return self.title
        if self.kind == WITHIN:
            return f"{self.text} within {show_time(self.within_ns)[2:]} of {self.trigger}"
        return self.kind if self.kind == NO_TRAP else f"{self.kind} {self.text}"

    @property
    def is_reach(self) -> bool:
        return self.kind == REACH


@dataclass(frozen=True)
class Names:
    """Finds names in a program; what begins with a variable of `prefix`, a path with a dot behind it, needs no path."""

    image: Image
    prefix: str = ""

    def find(self, text: str) -> Place | Span:
        """The place that `text` names.  Raises UnknownPlace."""
        symbols, areas = self.image.symbols, self.image.layout.areas
        whole = find(symbols, areas, self.prefix.rstrip(".")) if self.prefix else None
        instance = whole if isinstance(whole, Place) else None
        return Scope(lambda name: find(symbols, areas, name), instance).find(text)

    def condition(self, text: str) -> Condition:
        """The condition that `text` writes.  Raises ConditionError."""
        return parse_condition(text, self.find)

    def places(self, text: str) -> tuple[Place, ...]:
        """The places that `text` names.  Raises UnknownPlace, also for what lies behind a reference."""
        found = self.find(text)
        places = found.places if isinstance(found, Span) else (found,)
        if any(place.hops for place in places):
            raise UnknownPlace(f"{text} lies behind a reference: name the variable itself")
        return places

    def extents(self, text: str) -> list[tuple[int, int, int | None]]:
        """Where the places lie that a name, address or range names: offset, bytes, bit.  Raises UnknownPlace."""
        places = self.places(text)
        for place in places:
            if part := _unfree(place.type, text):
                raise UnknownPlace(f"{part}: bits, numbers and times can be free, texts, references and instances cannot")
        return [(place.offset, place.type.size, place.bit) for place in places]


def _unfree(type: Type, path: str) -> str:
    """The first part of a variable that cannot be free, with its type; empty if there is none."""
    if isinstance(type, StringType | RefType | AnyType | OpenArrayType):
        return f"{path} is of {type}"
    if isinstance(type, ArrayType):
        return _unfree(type.element, f"an element of {path}")
    if isinstance(type, StructType):
        if type.block:  # it begins with the number of its type, by which calls find their body
            return f"{path} is an instance of {type}"
        return next(filter(None, (_unfree(member.type, f"{path}.{member.name}") for member in type.fields.values())), "")
    return ""


@dataclass(frozen=True)
class Run:
    """A run that answers a question: what is written before each scan, and what was seen behind each.

    `writes` has for each scan the inputs that change, with their values, `times_ns` when it begins; `cycle_ns` is the cycle, if
    that is fixed, else the shortest one.  `is_shortest` tells whether no shorter run does it."""

    writes: tuple[dict[Place, Value], ...]
    times_ns: tuple[int, ...]
    cycle_ns: int
    is_shortest: bool
    trap: Trap | None = None
    asked_ns: int = 0
    """Of WITHIN: when the trigger became true whose answer does not come in time."""
    has_free_times: bool = False
    """True if its scans could have begun at other times: there was no fixed cycle."""
    writers: tuple[str, ...] = ()
    """Of WRITTEN_ONCE: the places of two statements that write the same bit in the last scan."""

    @property
    def scans(self) -> int:
        return len(self.writes)

    @property
    def passed_ns(self) -> list[int]:
        """The time between each scan but the first and the one before."""
        return [after - before for before, after in pairwise(self.times_ns)]


@dataclass(frozen=True)
class Verdict:
    """The answer to a question.

    `word` is PROVED, BROKEN, REACHED, UNREACHABLE or UNDECIDED; `how` says by which method, in words; `scans` is the number of
    scans from power-on in which it is certain that no run gets there."""

    question: Question
    word: str
    how: str
    scans: int = 0
    run: Run | None = None
    places: tuple[Place, ...] = ()
    """What the property names."""
    notes: tuple[str, ...] = field(default=())
    """What limits the answer: assumptions, values that are constants, statements that nothing reaches."""
    is_kept: bool = False
    """True if the proof was not made now, but kept on disk by an earlier call."""

    @property
    def is_good(self) -> bool:
        """True if the property holds for certain, or what was to be reached was reached."""
        return self.word in (PROVED, REACHED)
