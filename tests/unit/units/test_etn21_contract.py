"""One description of rows and codes: a field or a value that only the ETN21's program has, or only Python, is named."""

from __future__ import annotations

from functools import cache

import pytest

from fbvm import Etn21, LoopNetwork, Plc, compile_text
from fbvm.base.areas import NEVER
from fbvm.base.data import data_folder
from fbvm.processor.contract import Contract, ContractError
from fbvm.processor.processor import contract, processor
from fbvm.units.contract import KEEP
from fbvm.units.etn21 import codes
from fbvm.units.etn21.faults import Fault, Faults
from fbvm.units.etn21.inside import PROGRAM
from fbvm.units.etn21.mail import Mail, agreed
from fbvm.units.etn21.map import CIO_WORDS, D_WORDS, Switch, TcpState
from fbvm.wire.link import Failed, Grant, Opened, Peer, Received, Sent

MAIL = "fbvm.units.etn21.mail"


@cache
def memory_text() -> str:
    return (data_folder("fblib") / "omron" / "etn21" / "ETN21_Memory.st").read_text(encoding="utf-8")


def variant(*changes: tuple[str, str]) -> str:
    """A program with the ETN21's memory as it would be with these changes, which does nothing."""
    text = memory_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    return f"{text}\nPROGRAM Unit END_PROGRAM\n"


def varied(*changes: tuple[str, str]) -> Contract:
    return contract(variant(*changes))


EVENT, REQUEST, MOVE, FAULT = ("ETN21_Event : STRUCT", "ETN21_Request : STRUCT", "ETN21_Move : STRUCT", "ETN21_Fault : STRUCT")
PLACE = "Place : UDINT;                      // of Received"


@pytest.mark.parametrize(("old", "new", "said"), [
    (EVENT, f"{EVENT} Urgency : UINT;", f"ETN21_Event has Urgency in the program, of which {MAIL} does not know"),
    (REQUEST, f"{REQUEST} Urgency : UINT;", f"ETN21_Request has Urgency in the program, of which {MAIL} does not know"),
    (MOVE, f"{MOVE} Urgency : UINT;", f"ETN21_Move has Urgency in the program, of which {MAIL} does not know"),
    ("Peer_Closed,", "Peer_Closed, Slowed_Down,", f"ETN21_Told has Slowed_Down in the program, of which {MAIL} does not know"),
    ("Send_To,", "Send_To, Multicast,", f"ETN21_Asked has Multicast in the program, of which {MAIL} does not know"),
    (PLACE, "//", "ETN21_Event has no place; it has Kind, Channel, Error, Local_Port, Host[0], Host[1], Port, Size"),
    ("        Peer_Closed,", "        Half_Closed,", "ETN21_Told has no peer_closed; it has Nothing, Opened, Failed, Sent, "),
    ("        Send_To,", "        Send_Datagram,", "ETN21_Asked has no send_to; it has Nothing, Connect, "),
    ("Kind : ETN21_Told;", "Kind : UINT;", "ETN21_Event.Kind is UINT and no enumeration"),
])  # fmt: skip
def test_a_field_or_a_value_on_one_side_only_is_named(old: str, new: str, said: str) -> None:
    agreed(varied())
    with pytest.raises(ContractError) as raised:
        agreed(varied((old, new)))
    assert said in str(raised.value)


def test_a_fault_too() -> None:
    own = processor(variant((FAULT, f"{FAULT} Times : UINT;")))
    with pytest.raises(ContractError, match=r"ETN21_Fault has Times in the program, of which fbvm\.units\.etn21\.faults does"):
        Faults(own)


def test_rows_follow_the_program_wherever_their_fields_lie() -> None:
    """Fields in another order and of other sizes, kinds with other numbers: nothing of it is known anywhere else."""
    own = processor(variant(
        (PLACE, "//"), (EVENT, f"{EVENT} {PLACE}\n"), ("Channel : UINT;                     // the", "Channel : ULINT; // the"),
        ("        Peer_Closed,", "        Peer_Closed := 5000,"), ("Opened,\n        Failed,", "Failed,\n        Opened,"),
        ("Code : ETN21_Code;\n        Switch : UINT; ", "Switch : UINT;\n        Code : ETN21_Code; "),
    ))  # fmt: skip
    mail, told = Mail(own, None), own.contract.enumeration("ETN21_Told")
    mail.post([Opened(3, 9000, Peer("10.1.2.3", 77)), Failed(1, "open", "ECONNREFUSED"), Sent(2, 5), Received(8, b"abc")])
    names = ("place", "kind", "channel", "local_port", "host[0]", "host[1]", "port", "error", "size")
    record = own.contract.record("ETN21_Events")
    rows = list(record.rows(*names)(own.view("ETN21_Events")[: 4 * record.size]))
    assert rows == [
        (0, told["opened"], 3, 9000, 0x0A01, 0x0203, 77, 0, 0),
        (0, told["failed"], 1, 0, 0, 0, 0, codes.code_of("ECONNREFUSED"), 0),
        (0, told["sent"], 2, 0, 0, 0, 0, 0, 5), (3, told["received"], 8, 0, 0, 0, 0, 0, 3),
    ]  # fmt: skip
    assert (told["failed"], told["opened"], told["peer_closed"]) == (1, 2, 5000)
    faults = Faults(own)
    faults[:] = [Fault(0x0302, Switch.SEND, 4), Fault(1)]
    assert faults == [Fault(0x0302, Switch.SEND, 4), Fault(1)]
    assert own.view("ETN21_Filler")[0] == KEEP


def test_every_row_of_requests_is_done_in_their_order() -> None:
    own = processor(PROGRAM)
    mail, plc = Mail(own, None), Plc(compile_text("PROGRAM Main END_PROGRAM").image)
    kinds, pack = own.contract.enumeration("ETN21_Asked"), own.contract.record("ETN21_Requests").packer("kind", "channel", "size")
    rows = own.contract.array("ETN21_Requests")[1]
    for number in range(rows):
        pack(own.view("ETN21_Requests"), number * own.contract.record("ETN21_Requests").size, kinds["grant"], number % 8, number)
    for asked in (rows, 3):
        own.view("ETN21_Requested")[0] = own.view("ETN21_Urgent")[0] = asked
        assert mail.collect(plc.memory) == [Grant(number % 8, number) for number in range(asked)]
        assert (own.view("ETN21_Requested")[0], own.view("ETN21_Urgent")[0]) == (0, 0)


def test_names_for_charts_are_those_of_the_program() -> None:
    """What programs see of a unit is written down for charts, too, which do not wait for a compiler."""
    own = contract(PROGRAM)
    own.enumeration("ETN21_Switch").require([switch.name for switch in Switch], "map")
    own.enumeration("ETN21_State").require([state.name for state in TcpState], "map")
    assert {switch: own.enumeration("ETN21_Switch")[switch.name] for switch in Switch} == {switch: switch for switch in Switch}
    assert {state: own.enumeration("ETN21_State")[state.name] for state in TcpState} == {state: state for state in TcpState}
    assert (own.array("ETN21_N")[1], own.array("ETN21_M")[1]) == (CIO_WORDS, D_WORDS)
    used = own.enumeration("ETN21_Code")
    for name in ("NORMAL_END", "TIMED_OUT", "SOCKET_CLOSED", "LOCAL_ADDRESS_ERROR", "CPU_UNIT_ERROR", "PARAMETER_RANGE",
                 "AREA_CODE", "BIT_NUMBER", "OTHER_PROCESSING", "ALREADY_OPEN", "NOT_OPEN", "OTHER_PROTOCOL", "OTHER_SOCKET"):
        assert used[name] == getattr(codes, name)
    for name in ("EACCES", "EPIPE", "EMSGSIZE", "EADDRINUSE", "EADDRNOTAVAIL", "ETIMEDOUT"):
        assert used[name] == codes.ERRNO[name]


@pytest.mark.parametrize("switched_on", [False, True])
def test_an_idle_unit_never_wakes_whether_its_processor_runs_or_not(switched_on: bool) -> None:
    plc = Plc(compile_text("PROGRAM Main VAR x : BOOL; END_VAR x := NOT x; END_PROGRAM").image)
    unit = Etn21(0, "192.168.250.21")
    if switched_on:
        unit.faults.clear()
    plc.attach(unit, LoopNetwork())
    plc.run(scans=3)
    assert (unit.wake_ns, plc.due_ns) == (NEVER, NEVER)
