"""The fronts of units: lamps, dials and sockets, read from the words that programs see."""

from __future__ import annotations

from common_unit_tests import CYCLE_NS, FakeMemory
from etn21_rig import Rig

from fbvm.units.etn21.map import Switch
from fbvm.units.etn21.unit import Etn21
from fbvm.units.front import Front, Socket
from fbvm.units.port.noc import Noc
from fbvm.units.port.tianxing import Tianxing
from fbvm.wire.link import Failed, Opened, Peer


def lit(front: Front) -> list[str]:
    return [lamp.name for lamp in front.lamps if lamp.is_on]


def test_an_etn21_shows_its_dials_and_what_its_socket_does() -> None:
    rig = Rig(Etn21(12, "192.168.250.172"))
    assert rig.unit.front(rig.memory).settings == (("UNIT No.", "C"), ("NODE No.", "AC"))
    rig = Rig(Etn21(0, "192.168.250.172", fins=True, fins_node=7))
    assert rig.unit.front(rig.memory).settings == (("UNIT No.", "0"), ("NODE No.", "07"))
    rig = Rig()
    assert (lit(rig.unit.front(rig.memory)), rig.unit.front(rig.memory).sockets) == (["RUN", "LNK"], ())
    rig.parameters()
    rig.scan(Switch.ACTIVE_OPEN)
    [socket] = rig.unit.front(rig.memory).sockets
    assert (socket.name, socket.state, socket.peer) == ("TCP 1", "SYN_SENT, opening", str(rig_server(rig)))
    rig.scan(Opened(1, 49152, rig_server(rig)))
    rig.scan()
    front = rig.unit.front(rig.memory)
    assert lit(front) == ["RUN", "LNK", "TCP"] and (front.sockets[0].state, front.sockets[0].local) == ("ESTABLISHED", "49152")
    assert front.restart == ("A501.00", "TRUE")


def rig_server(rig: Rig) -> Peer:
    """The peer in the parameters of area 1, as the rig writes them."""
    high, low = rig.d[30020], rig.d[30021]
    return Peer(f"{high >> 8}.{high & 255}.{low >> 8}.{low & 255}", rig.d[30022])


def test_an_etn21_shows_how_a_service_failed_and_its_errors() -> None:
    rig = Rig()
    rig.parameters()
    rig.scan(Switch.ACTIVE_OPEN)
    rig.scan(Failed(1, "open", "ECONNREFUSED"))
    rig.scan()
    [socket] = rig.unit.front(rig.memory).sockets
    assert socket.state == "CLOSED" and socket.result.endswith("ECONNREFUSED")
    rig.unit.link_up = False
    rig.unit.error_status = 1 << 14 | 1 << 15
    rig.scan()
    front = rig.unit.front(rig.memory)
    assert lit(front) == ["RUN", "ERC", "ERH"]
    assert [lamp.said for lamp in front.lamps[1:4]] == ["EEPROM Error", "Address Disagreement", "no link: the cable is pulled"]


def test_an_etn21_shows_a_socket_that_only_its_status_tells_of() -> None:
    rig = Rig()
    layout = rig.unit.layout
    rig.memory.words("CIO")[layout.status("UDP", 2)] = 1 << 15 | 1
    assert [(socket.name, socket.state) for socket in rig.unit.front(rig.memory).sockets] == [("UDP 2", "OPEN, opening")]


def test_units_with_a_mailbox_show_their_lines() -> None:
    for unit, lamps in ((Noc(), ["RUN", "LINK", "100 MB"]), (Tianxing(), ["READY"])):
        memory = FakeMemory()
        unit.reset(memory)
        assert (lit(unit.front(memory)), unit.front(memory).sockets) == (lamps, ())
        box = unit._mailbox.lines
        line = memory.words(unit.table.area)[box.first_word : box.first_word + box.size]
        line[box.words.module], line[box.words.command] = unit.table.number(unit), box.commands.connect
        line[box.words.remote_ip], line[box.words.remote_ip + 1], line[box.words.remote_port] = 0xC0A8, 0xFA01, 502
        unit.refresh(memory, [], CYCLE_NS)
        assert unit.front(memory).sockets == (Socket("line 0", "OPENING", "", "192.168.250.1:502"),)
        unit.refresh(memory, [Failed(0, "open", "ECONNREFUSED")], 2 * CYCLE_NS)
        [socket] = unit.front(memory).sockets
        assert socket.state == "FAILED" and socket.result


def test_a_module_names_its_error_its_counters_and_its_restart() -> None:
    noc, memory = Noc(), FakeMemory()
    noc.reset(memory)
    noc.link_up = False
    noc.refresh(memory, [], CYCLE_NS)
    front = noc.front(memory)
    assert lit(front) == ["RUN", "100 MB"] and dict(front.settings)["restarts"] == "0"
    assert front.restart == ("MSTR_Modules[8].Restart", "1") and Tianxing().front(memory).restart is None


def test_a_program_without_the_mailbox_is_said() -> None:
    class Nothing:
        def words(self, area: str) -> memoryview:
            raise KeyError(area)

    assert dict(Noc().front(Nothing()).settings)["mailbox"] == "no block of this program uses NOC"
