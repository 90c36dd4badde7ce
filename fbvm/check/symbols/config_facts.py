"""What VAR_CONFIG and VAR_ACCESS say about variables that they name by paths."""

from __future__ import annotations

from dataclasses import dataclass

from fbvm.base.areas import Address
from fbvm.base.types import Field, Type
from fbvm.check.symbols.facts import Variable


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
    """What VAR_CONFIG says about a variable: its address, or its initial bytes."""

    spot: Spot
    address: Address | None
    initial: bytes | None


@dataclass(frozen=True, eq=False)
class AccessPath:
    """What VAR_ACCESS says about a variable: another name, and whether that name can be written."""

    name: str
    spot: Spot
    writable: bool
