"""What a configuration says: the tasks with what they run; VAR_CONFIG and VAR_ACCESS about variables named by paths."""

from __future__ import annotations

from dataclasses import dataclass, field

from fbvm.base.areas import Address
from fbvm.base.types import Field, Type
from fbvm.check.symbols.facts import Pou, Variable


@dataclass(frozen=True, eq=False)
class Spot:
    """A variable that is named by a path: a program or global variable, then members and numbers of elements.

    Without a root it is an address."""

    root: Variable | None
    steps: tuple[Field | int, ...]
    type: Type
    address: Address | None = None


@dataclass(frozen=True, eq=False)
class Completed:
    """What VAR_CONFIG says about a variable: its address, or its initial bytes.

    A variable that could have a place, and has none, lies at `own`, a variable of its instance."""

    spot: Spot
    address: Address | None
    initial: bytes | None
    own: Spot | None = None


@dataclass(frozen=True, eq=False)
class AccessPath:
    """What VAR_ACCESS says about a variable: another name, and whether that name can be written."""

    name: str
    spot: Spot
    writable: bool


@dataclass(frozen=True, eq=False)
class Run:
    """What a task runs: an instance of a program, or a block in it."""

    instance: Variable
    pou: Pou
    block: Variable | None = None

    @property
    def name(self) -> str:
        return self.instance.name if self.block is None else f"{self.instance.name}.{self.block.name}"

    @property
    def offset(self) -> int:
        """Where in the buffer it lies, after layout."""
        return self.instance.offset + (self.block.offset if self.block is not None else 0)


@dataclass
class TaskFact:
    """A task of the configuration, or the one task that runs everything."""

    name: str
    priority: int
    interval_ns: int
    single: str = ""
    runs: list[Run] = field(default_factory=list)
