"""Both sides of a mailbox name words, commands and states alike; a new vendor is a table, a library.toml and ST."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import ClassVar

import pytest
from common_unit_tests import CommonUnitTests, FakeMemory

from fbvm.base.data import data_folder
from fbvm.processor.contract import Contract, ContractError
from fbvm.processor.processor import contract
from fbvm.units.contract import Unit
from fbvm.units.port.noc import Noc
from fbvm.units.port.unit import MailboxUnit, Table
from fbvm.units.port.words import Mailbox, lines_of, mailbox

PORT = data_folder("fblib") / "port"


def varied(name: str, old: str, new: str) -> Contract:
    """A program with a line and its types, one of which differs."""
    paths = [PORT / f"{stem}.st" for stem in ("PORT_Command", "PORT_State", "PORT_Line")]
    texts = {path.stem: path.read_text(encoding="utf-8") for path in paths}
    assert old in texts[name]
    texts[name] = texts[name].replace(old, new, 1)
    return contract("\n".join(texts.values()) + "\nVAR_GLOBAL Lines : ARRAY[1..2] OF PORT_Line; END_VAR\nPROGRAM P END_PROGRAM\n")


@pytest.mark.parametrize(("name", "old", "new", "said"), [
    ("PORT_Line", "Note : WORD;", "Note : WORD; Urgency : UINT;", "PORT_Line has Urgency in the program, of which fbvm.units"),
    ("PORT_Line", "Local_Port : UINT;", "Own_Port : UINT;", "PORT_Line has no local_port; it has Owner, Module, Command"),
    ("PORT_Command", "    Reset  ", "    Pause, Reset  ", "PORT_Command has Pause in the program, of which fbvm.units"),
    ("PORT_Command", "    Reset  ", "    Break  ", "PORT_Command has no reset; it has Close, Connect, Listen, Break"),
    ("PORT_State", "Closing", "Closing, Paused", "PORT_State has Paused in the program, of which fbvm.units"),
])  # fmt: skip
def test_a_word_or_a_value_on_one_side_only_is_named(name: str, old: str, new: str, said: str) -> None:
    with pytest.raises(ContractError) as raised:
        lines_of(varied(name, old, new), "Lines", 0)
    assert said in str(raised.value)


def test_words_and_values_follow_the_program() -> None:
    lines = lines_of(varied("PORT_Line", "Owner : UINT;", "Owner : ULINT;"), "Lines", 5)
    assert (lines.first_word, lines.count, lines.size, lines.words.module, lines.words.command) == (5, 2, 404, 4, 5)
    commands = lines_of(varied("PORT_Command", "    Listen, ", "    Listen := 77, "), "Lines", 0).commands
    assert (commands.close, commands.connect, commands.listen, commands.reset) == (0, 1, 77, 78)


# --- a vendor that nobody knows ---------------------------------------------------------------------------------------

LIBRARY = Path(__file__).resolve().parent / "new_vendor"


@dataclass(eq=False)
class Newcomer(MailboxUnit):
    """The unit of the library beside this file."""

    address: str = "192.168.250.24"
    table: ClassVar[Table] = Table(name="Newcomer", area="NEWC", block="NEW_Ask", lines="NEW_Lines", libraries=(LIBRARY,),
                                   shows={"NEW_State": lambda unit: "there", "NEW_Version": lambda unit: 3})  # fmt: skip


class TestANewVendorIsAUnit(CommonUnitTests):
    @pytest.fixture(autouse=True)
    def _sized(self, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
        monkeypatch.setitem(self.sizes, "NEWC", self.box.words)
        yield

    box = mailbox("NEW_Ask", "NEWC", "NEW_Lines", (LIBRARY,))

    def new_unit(self) -> Unit:
        return Newcomer()

    def line(self, memory: FakeMemory) -> memoryview:
        return memory.words("NEWC")[self.box.head_words : self.box.head_words + self.box.lines.size]

    def may_write(self) -> set[tuple[str, int]]:
        at = self.box.lines.words
        own = (at.command, at.state, at.error, at.peer_ip, at.peer_ip + 1, at.peer_port, at.sending, at.received)
        return {("NEWC", word) for word in (*range(self.box.head_words), *(self.box.head_words + word for word in own))}

    def data_words(self) -> set[tuple[str, int]]:
        first = self.box.head_words
        return {("NEWC", word) for word in range(first + self.box.lines.words.incoming, first + self.box.lines.size)}

    def ask(self, memory: FakeMemory) -> None:
        words, at = self.line(memory), self.box.lines.words
        words[at.module], words[at.remote_ip], words[at.remote_ip + 1], words[at.remote_port] = 1, 0xC0A8, 0xFA07, 502
        words[at.command] = self.box.lines.commands.connect

    def is_answered(self, memory: FakeMemory) -> bool:
        return self.line(memory)[self.box.lines.words.state] == self.box.lines.states.open


def test_the_head_of_a_new_vendor() -> None:
    class Memory:
        areas: ClassVar[dict[str, memoryview]] = {"NEWC": memoryview(bytearray(2 * TestANewVendorIsAUnit.box.words)).cast("H")}

        def words(self, area: str) -> memoryview:
            return self.areas[area]

    memory = Memory()
    Newcomer().reset(memory)
    assert memory.words("NEWC")[:3].tolist() == [1, 3, 0]


@pytest.mark.slow
def test_a_library_that_brings_another_mailbox() -> None:
    own = mailbox("MBP_MSTR", "NOC", "MSTR_Lines")
    assert own.lines.count == 32 and Noc.table.area == "NOC"
    made = contract("PROGRAM P VAR b : MBP_MSTR; END_VAR b(); END_PROGRAM")
    with pytest.raises(ContractError, match="brings no mailbox TXP, but NOC"):
        Mailbox(made, "TXP", "MSTR_Lines")
    with pytest.raises(ContractError, match="MSTR_Module has no module"):
        Mailbox(made, "NOC", "MSTR_Modules")


@pytest.mark.slow
def test_lines_that_do_not_fill_the_slots_of_the_mailbox_are_refused() -> None:
    made = contract("PROGRAM P VAR b : MBP_MSTR; END_VAR b(); END_PROGRAM")
    box = made.image.layout.mailboxes[0]
    for field, more in (("head_words", 1), ("slots", 1), ("slot_words", -1)):
        changed = replace(box, **{field: getattr(box, field) + more})
        layout = SimpleNamespace(mailboxes=(changed,), areas=made.image.layout.areas)
        other = SimpleNamespace(image=SimpleNamespace(layout=layout), place=made.place, record=made.record, array=made.array)
        with pytest.raises(ContractError, match="MSTR_Lines has not the slots of the mailbox NOC"):
            Mailbox(other, "NOC", "MSTR_Lines")  # type: ignore[arg-type]
