"""The words of a mailbox, as the ST of its library declares them: where each lies, and which numbers say what.

A mailbox is an area that a unit brings (`[mailbox]` in a `library.toml`): words for the unit as a whole, its head, then lines,
each a `PORT_Line` of `fblib/port` for one TCP connection."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path

from fbvm.processor.contract import Contract, ContractError, Enumeration
from fbvm.processor.processor import contract

OWN_WORDS = ("owner", "note")
"""Of a line: words that are the program's own."""


@dataclass(frozen=True)
class Commands:
    """What a program commands in a line (PORT_Command), as numbers."""

    close: int
    connect: int
    listen: int
    reset: int


@dataclass(frozen=True)
class States:
    """What a unit says of a line's connection (PORT_State), as numbers."""

    closed: int
    opening: int
    open: int
    ended: int
    failed: int
    closing: int


@dataclass(frozen=True)
class LineWords:
    """Where in a line, a PORT_Line, its words lie; the other numbers are in the words' names."""

    module: int
    command: int
    state: int
    error: int
    remote_ip: int
    remote_port: int
    local_port: int
    keep_alive: int
    peer_ip: int
    peer_port: int
    sending: int
    received: int
    outgoing: int
    incoming: int


@dataclass(frozen=True)
class Lines:
    """The lines of a mailbox: how many there are, how many words each has, the number of the first one's first word."""

    first_word: int
    count: int
    size: int
    words: LineWords
    outgoing_bytes: int
    incoming_bytes: int
    commands: Commands
    states: States


class Mailbox:
    """The mailbox that a block of a library brings; `area` is its name, `lines` the library's variable with its lines.

    Raises ContractError if the library declares something else."""

    def __init__(self, own: Contract, area: str, lines: str) -> None:
        brought = {box.name: box for box in own.image.layout.mailboxes}
        if area not in brought:
            raise ContractError(f"the library brings no mailbox {area}, but {', '.join(brought) or 'none'}")
        self._contract = own
        self._offset = own.image.layout.areas[area].offset
        self.words = brought[area].words
        self.head_words = brought[area].head_words
        self.lines = found = lines_of(own, lines, self.word(lines)[0])
        if (found.first_word, found.count, found.size) != (self.head_words, brought[area].slots, brought[area].slot_words):
            raise ContractError(f"{lines} has not the slots of the mailbox {area}")

    def word(self, variable: str) -> tuple[int, int]:
        """The number of a variable's first word in the mailbox, and how many it has.  Raises UnknownPlace."""
        place = self._contract.place(variable)
        return (place.offset - self._offset) // 2, place.type.size // 2

    def enumeration(self, variable: str) -> Enumeration:
        """The values that a variable of enumerated type may have."""
        return Enumeration(self._contract.place(variable).type, variable)


@cache
def mailbox(block: str, area: str, lines: str, libraries: tuple[Path, ...] = ()) -> Mailbox:
    """The mailbox of the library that has this function block; `libraries` are folders beside `fblib/` to find it in."""
    return Mailbox(contract(f"PROGRAM Unit\nVAR Block : {block}; END_VAR\nBlock();\nEND_PROGRAM\n", libraries), area, lines)


def lines_of(own: Contract, variable: str, first_word: int) -> Lines:
    """The lines in a variable, an array of PORT_Line, which begins with this word of the mailbox.

    Raises ContractError unless program and this module name the same words, commands and states."""
    line, (_, count, size) = own.record(variable), own.array(variable)
    names = [field.name for field in fields(LineWords)]
    line.require([*names, *OWN_WORDS], __name__)
    words = {name: line.part(name)[0] // 2 for name in names}
    return Lines(first_word, count, size // 2, LineWords(**words), line.part("outgoing")[1], line.part("incoming")[1],
                 Commands(**_numbers(Commands, line.enumeration("command"))),
                 States(**_numbers(States, line.enumeration("state"))))  # fmt: skip


def _numbers(names: type[Commands | States], known: Enumeration) -> dict[str, int]:
    """The numbers that these names have in the program."""
    wanted = [field.name for field in fields(names)]
    known.require(wanted, __name__)
    return {name: known[name] for name in wanted}
