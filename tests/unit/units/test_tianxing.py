"""The Ethernet port of a Tianxing controller as a unit: what every unit owes, its head, its connections."""

from __future__ import annotations

import tomllib

import pytest
from common_unit_tests import CommonUnitTests, FakeMemory

from fbvm.base.areas import NEVER
from fbvm.base.data import data_folder
from fbvm.units.contract import Unit
from fbvm.units.port.tianxing import Tianxing
from fbvm.units.port.words import mailbox
from fbvm.wire.link import Connect, Failed, Peer

BOX = mailbox(Tianxing.table.block, Tianxing.table.area, Tianxing.table.lines)
LINES, LINE, COMMAND, STATE = BOX.lines, BOX.lines.words, BOX.lines.commands, BOX.lines.states
HEAD_WORDS = BOX.head_words


def slot(memory: FakeMemory) -> memoryview:
    return memory.words("TXP")[HEAD_WORDS : HEAD_WORDS + LINES.size]


class TestTianxingIsAUnit(CommonUnitTests):
    def new_unit(self) -> Unit:
        return Tianxing()

    def may_write(self) -> set[tuple[str, int]]:
        unit_words = (LINE.command, LINE.state, LINE.error, LINE.peer_ip, LINE.peer_ip + 1,
                      LINE.peer_port, LINE.sending, LINE.received)  # fmt: skip
        return {("TXP", word) for word in range(8)} | {("TXP", HEAD_WORDS + word) for word in unit_words}

    def data_words(self) -> set[tuple[str, int]]:
        return {("TXP", HEAD_WORDS + word) for word in range(LINE.incoming, LINES.size)}

    def ask(self, memory: FakeMemory) -> None:
        words = slot(memory)
        words[LINE.module] = Tianxing.table.number(None)
        words[LINE.remote_ip : LINE.remote_port + 1] = memoryview(b"\xa8\xc0\x02\xfa\xf6\x01").cast("H")
        words[LINE.command] = COMMAND.connect

    def is_answered(self, memory: FakeMemory) -> bool:
        return slot(memory)[LINE.state] == STATE.open


def test_the_library_declares_what_the_port_brings() -> None:
    written = tomllib.loads((data_folder("fblib") / "tianxing" / "mb_tcp_server" / "library.toml").read_text())["mailbox"]
    assert written == {"area": "TXP", "head": HEAD_WORDS, "slots": LINES.count, "slot": LINES.size}


@pytest.mark.parametrize(("model", "connections"), [("T3", 8), ("T4", 32)])
def test_the_head(model: str, connections: int) -> None:
    memory = FakeMemory()
    Tianxing("10.1.2.3", model=model).reset(memory)
    assert memory.words("TXP")[:4].tolist() == [1, connections, 0x0A01, 0x0203]


def test_there_is_no_other_model() -> None:
    with pytest.raises(ValueError, match="T3 and T4"):
        Tianxing(model="T5")


def test_what_fails_has_one_number() -> None:
    port, memory = Tianxing(), FakeMemory()
    port.reset(memory)
    TestTianxingIsAUnit().ask(memory)
    assert port.refresh(memory, [], 0) == [Connect(0, Peer("192.168.250.2", 502))]
    port.refresh(memory, [Failed(0, "open", "ECONNREFUSED")], 1)
    assert (slot(memory)[LINE.state], slot(memory)[LINE.error]) == (STATE.failed, 1)


class Bare:
    """The memory of a program without a mailbox."""

    def words(self, area: str) -> memoryview:
        raise KeyError(area)


def test_at_power_on_it_wants_one_refresh_and_then_none_by_itself() -> None:
    port, memory, wanted = Tianxing(), FakeMemory(), []
    for _ in range(2):
        port.reset(memory)
        wanted.append(port.wake_ns)
        port.refresh(memory, [], 5)
        wanted.append(port.wake_ns)
    assert wanted == [0, NEVER, 0, NEVER]


def test_a_plc_without_a_mailbox_leaves_it_idle() -> None:
    port = Tianxing()
    for memory, wake_ns in ((Bare(), NEVER), (FakeMemory(), 0), (Bare(), NEVER)):
        assert (port.reset(memory), port.wake_ns) == ([], wake_ns)
    assert port.refresh(Bare(), [], 0) == []
    assert port.settings == {}
