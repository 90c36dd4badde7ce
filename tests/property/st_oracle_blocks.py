"""What standard blocks and rungs do, written from the tables of the language and of the ladder instructions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

Frame = dict[Any, Any]
"""Variables of an instance; what is not a variable has a key that is no str."""
STATE = ("state",)


def _timer_on(b: Frame, now_ns: int) -> None:
    preset = max(b["PT"], 0)
    if not b["IN"]:
        b[STATE], b["Q"], b["ET"] = None, False, 0
        return
    if b.get(STATE) is None:
        b[STATE] = now_ns
    if not b["Q"]:
        b["ET"] = min(now_ns - b[STATE], preset)
        b["Q"] = b["ET"] >= preset


def _timer_off(b: Frame, now_ns: int) -> None:
    preset = max(b["PT"], 0)
    if b["IN"]:
        b[STATE], b["Q"], b["ET"] = "on", True, 0
        return
    if b.get(STATE) == "on":
        b[STATE] = now_ns
    if b["Q"]:
        b["ET"] = min(now_ns - b[STATE], preset)
        b["Q"] = b["ET"] < preset


def _pulse(b: Frame, now_ns: int) -> None:
    preset = max(b["PT"], 0)
    began, was = b.get(STATE, (None, False))
    if b["IN"] and not was and began is None:
        began, b["Q"] = now_ns, True
    if began is not None and b["Q"]:
        b["ET"] = min(now_ns - began, preset)
        b["Q"] = b["ET"] < preset
    if began is not None and not b["Q"] and not b["IN"]:
        began, b["ET"] = None, 0
    b[STATE] = began, b["IN"]


def _rose(b: Frame, pin: str) -> bool:
    was = b.get((pin,), False)
    b[pin,] = b[pin]
    return bool(b[pin] and not was)


def _count_up(b: Frame, now_ns: int) -> None:
    rose = _rose(b, "CU")
    if b["R"]:
        b["CV"] = 0
    elif rose and b["CV"] < 32767:
        b["CV"] += 1
    b["Q"] = b["CV"] >= b["PV"]


def _count_down(b: Frame, now_ns: int) -> None:
    rose = _rose(b, "CD")
    if b["LD"]:
        b["CV"] = b["PV"]
    elif rose and b["CV"] > -32768:
        b["CV"] -= 1
    b["Q"] = b["CV"] <= 0


def _count_both(b: Frame, now_ns: int) -> None:
    up, down = _rose(b, "CU"), _rose(b, "CD")
    if b["R"]:
        b["CV"] = 0
    elif b["LD"]:
        b["CV"] = b["PV"]
    elif up and not down and b["CV"] < 32767:
        b["CV"] += 1
    elif down and not up and b["CV"] > -32768:
        b["CV"] -= 1
    b["QU"], b["QD"] = b["CV"] >= b["PV"], b["CV"] <= 0


def _rising(b: Frame, now_ns: int) -> None:
    b["Q"] = b["CLK"] and not b.get(STATE, False)
    b[STATE] = b["CLK"]


def _falling(b: Frame, now_ns: int) -> None:
    """By the standard's body: its memory begins FALSE, so that a first call without CLK gives an edge."""
    b["Q"] = not b["CLK"] and not b.get(STATE, False)
    b[STATE] = not b["CLK"]


def _set_dominant(b: Frame, now_ns: int) -> None:
    b["Q1"] = b["S1"] or (b["Q1"] and not b["R"])


def _reset_dominant(b: Frame, now_ns: int) -> None:
    b["Q1"] = not b["R1"] and (b["S"] or b["Q1"])


BLOCKS: dict[str, Callable[[Frame, int], None]] = {
    "TON": _timer_on, "TOF": _timer_off, "TP": _pulse, "CTU": _count_up, "CTD": _count_down, "CTUD": _count_both,
    "R_TRIG": _rising, "F_TRIG": _falling, "SR": _set_dominant, "RS": _reset_dominant,
}  # fmt: skip
"""What a call does with the pins of an instance at a time."""


# --- rungs ------------------------------------------------------------------------------------------------------------


class Rungs:
    """Executes steps of ladder once, over the variables of an instance, in which the memory of edges is kept, too."""

    def __init__(self, frame: Frame) -> None:
        self._frame, self._stack = frame, []
        self._number = 0

    _stack: list[bool]

    def run(self, steps: tuple[tuple[str, str], ...]) -> None:
        for number, (mnemonic, operand) in enumerate(steps):
            self._number = number
            edge = mnemonic[0] if mnemonic[0] in "@%" else ""
            self._step(mnemonic.lstrip("@%"), edge, operand)

    def _step(self, name: str, edge: str, operand: str) -> None:
        if name.startswith(("LD", "AND", "OR")) and operand:
            self._contact(name, edge, operand)
        elif name in ("ANDLD", "ORLD"):
            last, first = self._stack.pop(), self._stack.pop()
            self._stack.append(first and last if name == "ANDLD" else first or last)
        elif name in ("NOT", "UP", "DOWN"):
            power = self._stack[-1]
            self._stack[-1] = not power if name == "NOT" else self._edge("@" if name == "UP" else "%", power)
        else:
            self._output(name, edge, operand)

    def _edge(self, edge: str, level: bool) -> bool:
        key = "edge", self._number
        was = self._frame.get(key, False)
        self._frame[key] = level
        return (level and not was) if edge == "@" else (was and not level)

    def _contact(self, name: str, edge: str, operand: str) -> None:
        closed = self._frame[operand]
        if edge:
            closed = self._edge(edge, closed)
        if name.endswith("NOT"):
            closed = not closed
        if name.startswith("LD"):
            self._stack.append(closed)
        elif name.startswith("AND"):
            self._stack[-1] = self._stack[-1] and closed
        else:
            self._stack[-1] = self._stack[-1] or closed

    def _output(self, name: str, edge: str, operand: str) -> None:
        power = self._stack[-1]
        if name == "KEEP":
            first, power = self._stack[-2:]
            self._frame[operand] = not power and (first or self._frame[operand])
        elif name in ("OUT", "OUTNOT"):
            self._frame[operand] = power if name == "OUT" else not power
        elif name in ("DIFU", "DIFD"):
            self._frame[operand] = self._edge("@" if name == "DIFU" else "%", power)
        elif self._edge(edge, power) if edge else power:
            self._frame[operand] = name == "SET"
