"""MBP_MSTR under any CONTROL, any answer and any cut of it; and the same memory on both engines."""

from __future__ import annotations

from random import Random

import pytest
from depth import times
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mstr_rig import CYCLE_NS, SERVER_IP, Rig, image_of, program
from test_mstr_errors import documented

from fbvm.machine.plc import Plc
from fbvm.net.faults import Fault
from fbvm.net.loop import LoopNetwork
from fbvm.net.peers import ModbusPeer, Reset, Say
from fbvm.units.port.noc import Noc
from fbvm.wire.link import Peer
from fbvm.wire.modbus_server import ModbusServer

FAST = "Reply_Time := T#200ms, Open_Time := T#200ms"
COMMON = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
WORDS = st.one_of(st.integers(0, 130), st.sampled_from([0x0700, 0x07FF, 0xFE00, 23, 65520, 65535, 192, 168, 250]),
                  st.integers(0, 65535))  # fmt: skip
OPERATIONS = st.sampled_from([1, 2, 3, 4, 7, 8, 10, 23, 0xFFF0])


@pytest.mark.slow
@settings(COMMON, max_examples=times(25))
@given(st.lists(st.tuples(OPERATIONS, st.lists(WORDS, min_size=10, max_size=10), st.booleans()), min_size=1, max_size=4))
def test_any_control_ends_with_a_documented_code(operations: list[tuple[int, list[int], bool]]) -> None:
    rig = Rig(options=FAST, databuf="ARRAY[1..60] OF WORD")
    for operation, words, is_right in operations:
        rest = [words[1] % 40 + 1, words[2] % 9000 + 1, 0x0700, *SERVER_IP, words[8] % 40 + 1, words[9] % 9000 + 1]
        code = rig.operate(operation, 0, *(rest if is_right else words[1:]), max_s=20)
        assert code in documented()
        if is_right and operation in (1, 2, 4, 10, 23):
            assert code == "0000"


@pytest.mark.slow
@settings(COMMON, max_examples=times(25))
@given(st.integers(0, 2**32), st.integers(1, 30), st.sampled_from([1, 2, 23]), st.booleans())
def test_registers_arrive_right_however_frames_are_cut(seed: int, cut: int, operation: int, random_cut: bool) -> None:
    dice = Random(seed)
    rig = Rig(ModbusPeer(ModbusServer(functions=(3, 16, 23))))
    rig.network.faults.append(Fault(segment_bytes=cut, random_cut=random_cut, gap_ns=1_000_000))
    held = [dice.randrange(65536) for _ in range(125)]
    ours = [dice.randrange(65536) for _ in range(121)]
    first, second, count, other = 1 + dice.randrange(100), 5000 + dice.randrange(100), dice.randint(1, 121), dice.randint(1, 125)
    for number, word in enumerate(held):
        rig.server.holding_registers[(first if operation == 2 else second) - 1 + number] = word
    rig.fill(ours)
    assert rig.operate(operation, 0, count, first, 0x0700, *SERVER_IP, other, second) == "0000"
    if operation == 2:
        assert rig.databuf(count) == held[:count]
    else:
        assert list(rig.server.holding_registers[first - 1 : first - 1 + count]) == ours[:count]
    if operation == 23:
        assert rig.databuf(other) == held[:other]


@pytest.mark.slow
@settings(COMMON, max_examples=times(30))
@given(st.binary(max_size=300), st.sampled_from([(2, 0, 3, 1), (1, 0, 3, 1), (7, 0, 38, 0), (8, 0, 0, 0)]), st.booleans())
def test_any_bytes_for_an_answer(data: bytes, control: tuple[int, ...], has_header: bool) -> None:
    """Never data that were not asked for, never stuck, and the next operation works."""
    answers = [lambda frame: frame[:4] + (len(data) + 1).to_bytes(2, "big") + frame[6:7] + data if has_header else data]
    rig = Rig(ModbusPeer(None, lambda frame: [Say(answers.pop()(frame) if answers else frame)]), options=FAST)
    rig.fill([0xEEEE] * 40)
    code = rig.operate(*control, 0x07FF, *SERVER_IP, max_s=5)
    assert code in documented()
    if code != "0000":
        assert rig.databuf(40) == [0xEEEE] * 40
    for _ in range(2):
        again = rig.operate(2, 0, 3, 1, 0x0700, *SERVER_IP, max_s=5)
    assert again == "0000"
    assert rig.databuf(3) == list(rig.server.holding_registers[:3])


@pytest.mark.slow
@settings(COMMON, max_examples=times(15))
@given(st.integers(0, 2**32), st.sampled_from(["good", "late", "silent", "refused", "resets"]))
def test_pins_at_any_time_and_no_path_is_lost(seed: int, kind: str) -> None:
    """Blocks that are switched about as it comes: at most one output is TRUE; in the end nobody has a line."""
    dice = Random(seed)
    ways = {"good": [Say], "late": [lambda frame: Say(frame, 70_000_000)], "silent": [], "resets": [lambda frame: Reset()]}
    peer = ModbusPeer(None, lambda frame: [way(frame) for way in ways.get(kind, [])])
    rig = Rig(peer, blocks=3, refused=kind == "refused", options=FAST + ", Max_Paths := 2")
    for _ in range(60):
        name = dice.randint(1, 3)
        rig.set(f"m{name}_ENABLE", dice.random() < 0.7)
        rig.set(f"m{name}_ABORT", dice.random() < 0.1)
        if dice.random() < 0.3:
            rig.control(dice.choice((1, 2, 3, 4, 7, 8, 10, 23, 99)), 0, 2, 1, 0x0700, *SERVER_IP, 2, 1, block=name)
        rig.scan(dice.randint(1, 3))
        for block in (1, 2, 3):
            assert len(rig.outputs(block)) <= 1
            assert "S" not in rig.outputs(block) or rig.status(block) == "0000"
            assert "E" not in rig.outputs(block) or rig.status(block) in documented()
    for block in (1, 2, 3):
        rig.set(f"m{block}_ENABLE", False)
    rig.scan()
    assert [rig.plc.read(f"MSTR_Lines[{number}].Owner") for number in range(1, 33)] == 32 * [0]


@pytest.mark.slow
def test_both_engines_give_the_same_memory() -> None:
    pytest.importorskip("llvmlite")
    plcs = []
    for engine in ("python", "native"):
        network, peer = LoopNetwork(3), ModbusPeer()
        network.faults.append(Fault(segment_bytes=7, random_cut=True))
        network.place(Peer("192.168.250.2", 502), peer)
        text = program(6, FAST, ("ARRAY[1..11] OF WORD", "ARRAY[1..125] OF WORD"), "s();")
        plc = Plc(image_of(text.replace("VAR", "VAR s : MSTR_Server;", 1)), CYCLE_NS, engine=engine)
        plc.attach(Noc(restart_ns=20 * CYCLE_NS), network)
        plcs.append(plc)
    dice = Random(4)
    for scan in range(400):
        changes = []
        if scan % 3 == 0:
            name = f"Main.m{dice.randint(1, 6)}"
            control = [dice.choice((1, 2, 2, 3, 4, 7, 8, 10, 23, 0xFFF0, 99)), 0, dice.randint(0, 130), dice.randint(0, 130),
                       0x0700 + dice.randint(0, 1), *SERVER_IP, dice.randint(1, 125), dice.randint(1, 10)]  # fmt: skip
            changes = [(f"{name}_ENABLE", dice.random() < 0.8), (f"{name}_ABORT", dice.random() < 0.1)]
            changes += [(f"{name}_CONTROL[{number}]", word) for number, word in enumerate(control, 1)]
        for plc in plcs:
            for name, value in changes:
                plc.write(name, value)
            assert plc.scan() is None
        assert plcs[0].memory.map[:] == plcs[1].memory.map[:], scan
