"""FINS commands about the CPU unit itself, each with the bytes of its answer: mode, data, units, status, times, clock, right."""

from __future__ import annotations

from datetime import datetime
from types import SimpleNamespace
from typing import Any, cast

from images import counter_image
from rows import each_of

from fbvm.base.areas import E_NAMES, e_bank
from fbvm.base.memory import Memory
from fbvm.machine.scan.clock_words import EPOCH
from fbvm.machine.servicing import status
from fbvm.machine.servicing.cpu import Asked, Refused
from fbvm.machine.servicing.registers import Registers
from fbvm.wire.fins.frames import Address

SECOND_NS = 1_000_000_000
LAYOUT = counter_image().layout


class Cpu:
    """A CPU unit that is asked by node 9."""

    def __init__(self, units: list[Any] | None = None, banks: int = 0, is_running: bool = True) -> None:
        areas = {**LAYOUT.areas, **{name: e_bank(name, 0) for name in E_NAMES[:banks]}}
        memory = Memory(LAYOUT.size, areas)
        self.modes: list[bool] = []
        self.machine = SimpleNamespace(memory=memory, units=[SimpleNamespace(unit=unit) for unit in units or []], now_ns=0,
                                       is_running=is_running, servicing_changes_mode=self.modes.append)  # fmt: skip
        self.registers = Registers(memory)

    def ask(self, command: Any, parameters: str = "", node: int = 9) -> str:
        """The answer in hexadecimal; in brackets the end code of a refusal, and what comes with it."""
        asked = Asked(cast(Any, self.machine), self.registers, Address(0, node, 0), bytes.fromhex(parameters))
        try:
            return str(command(asked).hex())
        except Refused as refused:
            return f"[{refused.end_code:04X}]{refused.data.hex()}"


def unit(number: int) -> Any:
    return SimpleNamespace(unit_number=number)


# --- operating mode -----------------------------------------------------------------------------------------------------


@each_of("parameters, answer, monitor", [
    ("", "", True), ("FFFF", "", True), ("0000", "", True), ("FFFF 02", "", True), ("0000 04", "", False),
    ("0001", "[1106]", None), ("FFFF 03", "[110C]", None), ("FFFF 00", "[110C]", None), ("FF", "[1002]", None),
    ("FFFF 02 00", "[1001]", None),
])
def test_run_begins_in_monitor_mode_unless_another_is_named(parameters: str, answer: str, monitor: bool | None) -> None:
    for running in (True, False):
        cpu = Cpu(is_running=running)
        cpu.registers.is_monitor = monitor is False
        cpu.registers.measure(5)
        assert cpu.ask(status.run, parameters) == answer
        assert cpu.registers.is_monitor is (monitor if monitor is not None else False)
        started = monitor is not None and not running
        assert cpu.modes == [True] * started and cpu.registers.cycle_times_ns == ((0, 0, 0) if started else (5, 5, 5))


@each_of("parameters, answer", [("", ""), ("FFFF", ""), ("0000", ""), ("FF", "[1002]"), ("0002", "[1106]")])
def test_stop_ends_a_program_that_runs(parameters: str, answer: str) -> None:
    for running in (True, False):
        cpu = Cpu(is_running=running)
        assert cpu.ask(status.stop, parameters) == answer and cpu.modes == [False] * (running and not answer)


# --- what it is ---------------------------------------------------------------------------------------------------------

MODEL = b"CJ2M-CPU33-FBVM     " + b"fbvm" + bytes(16)


@each_of("banks, units, system, areas, present", [
    (0, [], "0000", "000a 17 8000 08 00 00 00 0000 00", {}), (1, [0], "0000", "000a 17 8000 08 01 00 00 0000 00", {0: "8000"}),
    (13, [1, 15, None], "000c", "000a 17 8000 08 0d 00 00 0000 00", {1: "8000", 15: "8000"}),
])
def test_the_data_of_a_cpu_unit_and_of_its_units(banks: int, units: list[int | None], system: str, areas: str,
                                                 present: dict[int, str]) -> None:
    cpu = Cpu([object() if number is None else unit(number) for number in units], banks)
    first = f"{MODEL.hex()}{system}{'00' * 38}{areas.replace(' ', '')}"
    second = "".join(present.get(number, "0000") for number in range(16)) + "00" * 34 + "01"
    assert [cpu.ask(status.unit_data, part) for part in ("", "00", "01", "02")] == [first + second, first, second, "[110C]"]
    assert (len(first), len(second)) == (2 * 92, 2 * 67)


NAME = b"CJ1W-ETN21          ".hex()


@each_of("parameters, answer", [
    ("00", f"83 12 {NAME} 14 {NAME} 1F {NAME}"), ("12", f"83 12 {NAME} 14 {NAME} 1F {NAME}"), ("13", f"82 14 {NAME} 1F {NAME}"),
    ("00 03", f"83 12 {NAME} 14 {NAME} 1F {NAME}"), ("00 02", f"02 12 {NAME} 14 {NAME}"), ("15 01", f"81 1F {NAME}"),
    ("20", "80"), ("00 00", "00"),
])
def test_units_from_an_address_on(parameters: str, answer: str) -> None:
    assert Cpu([unit(15), unit(2), object(), unit(4)]).ask(status.connections, parameters) == answer.replace(" ", "").lower()


# --- how it does --------------------------------------------------------------------------------------------------------


@each_of("running, monitor, begins", [(True, True, "0102"), (True, False, "0104"), (False, True, "0000"), (False, False, "0000")])
def test_the_status_has_mode_and_errors(running: bool, monitor: bool, begins: str) -> None:
    cpu = Cpu(is_running=running)
    cpu.registers.is_monitor = monitor
    a = cpu.machine.memory.words("A")
    a[400], a[401], a[402] = 0x1234, 0x0100, 0x8000
    assert cpu.ask(status.status) == f"{begins} 0100 8000 0000 1234".replace(" ", "") + "20" * 16


def test_cycle_times_are_tenths_of_a_millisecond() -> None:
    cpu = Cpu()
    for time_ns in (250_000, 299_999, 1_200_000):
        cpu.registers.measure(time_ns)
    assert cpu.ask(status.cycle_time, "01") == "00000005 0000000c 00000002".replace(" ", "")
    assert cpu.ask(status.cycle_time, "02") == "[110C]" and cpu.registers.cycle_times_ns != (0, 0, 0)
    assert cpu.ask(status.cycle_time, "00") == "" and cpu.registers.cycle_times_ns == (0, 0, 0)
    assert [Cpu(is_running=False).ask(status.cycle_time, part) for part in ("00", "01")] == ["[2203]"] * 2


# --- the clock ----------------------------------------------------------------------------------------------------------


@each_of("date, answer", [
    ("2024-02-29 23:59:58", "24022923595804"), ("2026-11-22 13:44:00", "26112213440000"),
    ("2099-12-31 00:00:00", "99123100000004"), ("2000-01-01 09:05:07", "00010109050706"),
])
def test_the_clock_is_read_in_bcd(date: str, answer: str) -> None:
    cpu = Cpu()
    cpu.machine.now_ns = 5 * SECOND_NS + 999_999_999
    cpu.registers.clock_ns = int((datetime.fromisoformat(date) - EPOCH).total_seconds()) * SECOND_NS - 5 * SECOND_NS
    assert cpu.ask(status.read_clock) == answer


@each_of("parameters, date", [
    ("99 12 31 23 59", "2099-12-31 23:59:00"), ("24 02 29 00 00 59", "2024-02-29 00:00:59"),
    ("26 11 22 13 44 09 06", "2026-11-22 13:44:09"), ("00 01 01 00 00 00 00", "2000-01-01 00:00:00"),
    ("26 11 22 13 44 09 07", ""), ("23 02 29 00 00", ""), ("26 13 01 00 00", ""), ("26 1A 01 00 00", ""),
    ("A0 11 01 00 00", ""), ("26 11 00 00 00", ""),
    ("26 11 01 24 00", ""), ("26 11 01 00 60", ""), ("26 11 01 00 00 60", ""), ("26 11 01 00 00 00 0A", ""),
])
def test_the_clock_is_set(parameters: str, date: str) -> None:
    cpu = Cpu()
    cpu.machine.now_ns = 7 * SECOND_NS
    assert cpu.ask(status.set_clock, parameters) == ("" if date else "[1100]")
    seconds = int((datetime.fromisoformat(date) - EPOCH).total_seconds()) - 7 if date else 0
    assert cpu.registers.clock_ns == seconds * SECOND_NS


# --- the access right, errors -------------------------------------------------------------------------------------------


def test_the_access_right_is_held_by_one() -> None:
    cpu = Cpu()
    for command in (status.acquire, status.take_over, status.release):
        assert cpu.ask(command, "0001") == "[1106]"
    assert cpu.ask(status.acquire, "FFFF") == cpu.ask(status.acquire, "0000") == "" and cpu.registers.right == Address(0, 9, 0)
    assert cpu.ask(status.acquire, "FFFF", node=5) == "[3001]000900" and cpu.registers.right == Address(0, 9, 0)
    assert cpu.ask(status.take_over, "FFFF", node=5) == "" and cpu.registers.right == Address(0, 5, 0)
    assert cpu.ask(status.release, "0000") == "" and cpu.registers.right is None
    assert (status.held_by(None), status.held_by(Address(3, 2, 1))) == (b"", b"\1\2\3")


def test_the_log_of_errors_is_empty() -> None:
    cpu = Cpu()
    assert cpu.ask(status.read_error_log, "0000 0014") == "001400000000" and cpu.ask(status.read_error_log, "0001 0001") == ""
    assert cpu.ask(status.clear_error, "FFFF") == cpu.ask(status.clear_error_log) == ""
