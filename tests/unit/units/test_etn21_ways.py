"""A PLC with ETN21 units does the same to the bit whichever way its scans go, whatever its program asks of the units.

Inside machine code, beside it, looked into, and in Python; with data addresses in the words of the units, too."""

from __future__ import annotations

from functools import cache
from random import Random
from typing import Any

import pytest
from depth import times
from rows import first_quick

from fbvm import Plc, compile_text
from fbvm.code.image import Image
from fbvm.engine.native import engine as native
from fbvm.machine.plc import Mode
from fbvm.net.faults import Fault as NetFault
from fbvm.net.loop import LoopNetwork
from fbvm.net.peers import Fin, Leave, ModbusPeer, Reset, Say, ScriptedPeer
from fbvm.units.etn21.map import Switch
from fbvm.units.etn21.unit import Etn21, Fault
from fbvm.wire.link import Peer

if not native.available():
    pytest.skip("llvmlite is not installed", allow_module_level=True)

HOST, UNITS = "192.168.250.7", 2
ANSWERS = {
    502: ModbusPeer,
    503: lambda: ScriptedPeer([Say(b"x" * 300), Say(b"y" * 1500, 7_000_000), Fin(20_000_000)], greeting=[Say(bytes(2000))]),
    504: lambda: ScriptedPeer([Reset(3_000_000)], greeting=[Say(b"hello"), Leave(30_000_000)]),
}
"""Who waits at which port; nobody at the next one."""
ADDRESSES = {
    "its own words": "d[p + 6] := 16#8204; d[p + 7] := UDINT_TO_WORD(k MOD 256 * 256);",
    "the units' words": """
      IF k MOD 3 = 0 THEN d[p + 6] := 16#8275; ELSIF k MOD 3 = 1 THEN d[p + 6] := 16#B005; ELSE d[p + 6] := 16#8204; END_IF;
      d[p + 7] := UDINT_TO_WORD(k MOD 256 * 256);""",
}
"""Where the data of a request are: D1024, or about D30000 and CIO 1400."""
PROGRAM = """
FUNCTION Dice : UDINT
VAR_IN_OUT seed : UDINT; END_VAR
  seed := seed * 1664525 + 1013904223;
  Dice := DWORD_TO_UDINT(SHR(UDINT_TO_DWORD(seed), 12));
END_FUNCTION
PROGRAM Main
VAR
  seed : UDINT := {seed}; hash, k, u, area, place, p, switch : UDINT; is_open : BOOL;
  cio AT %CIO1500 : ARRAY[0..49] OF WORD; d AT %D30000 : ARRAY[0..199] OF WORD; restart AT %A501 : WORD;
END_VAR
  FOR k := 0 TO 49 DO hash := hash * 31 + WORD_TO_UDINT(cio[k]); END_FOR;
  IF Dice(seed) MOD {every} <> 0 THEN RETURN; END_IF;
  u := Dice(seed) MOD 2;
  area := Dice(seed) MOD 3;
  k := Dice(seed);
  IF k MOD 200 = 1 THEN cio[25 * u].2 := TRUE; RETURN; END_IF;
  IF k MOD 400 = 2 THEN restart := restart OR SHL(WORD#1, u); RETURN; END_IF;
  place := 25 * u + 19 + area / 2;
  IF (SHR(cio[place], 8 * (area MOD 2)) AND 16#3F) <> 0 AND k MOD 9 <> 0 THEN RETURN; END_IF;
  is_open := cio[25 * u + 9 + area].15 OR cio[25 * u + 1 + area].15;
  p := 100 * u + 18 + 10 * area;
  d[p] := UDINT_TO_WORD(area + 1 + k MOD 4 * 256); d[p + 1] := 0;
  d[p + 2] := 16#C0A8; d[p + 3] := 16#FA07; d[p + 4] := UDINT_TO_WORD(502 + k MOD 4);
  d[p + 5] := UDINT_TO_WORD(k MOD {size});
  switch := 2;
  IF k MOD 11 = 0 THEN switch := 5;
  ELSIF is_open THEN switch := 3 + k MOD 7 MOD 2;
  ELSIF k MOD 7 = 0 THEN switch := 0; d[p + 1] := 4000;
  ELSIF k MOD 5 = 0 THEN switch := 1; d[p + 1] := 3000; d[p + 2] := 0; d[p + 3] := 0; d[p + 4] := 0;
  ELSIF k MOD 5 = 1 THEN d[p + 3] := UDINT_TO_WORD(16#FA02 - u); d[p + 4] := 3000;
  END_IF;
  IF cio[25 * u + 1 + area].15 THEN d[p + 3] := UDINT_TO_WORD(16#FA02 - u); d[p + 4] := 4000; END_IF;
  {address}
  d[p + 8] := UDINT_TO_WORD(k MOD 6 * 2); d[p + 9] := 16#FFFF;
  cio[place] := cio[place] OR SHL(WORD#1, switch + 8 * (area MOD 2));
END_PROGRAM
"""
WAYS = ("inside", "beside", "looked into", "in Python")


@cache
def image(**values: object) -> Image:
    text = PROGRAM
    for name, value in values.items():
        text = text.replace("{" + name + "}", str(value))
    compilation = compile_text(text)
    assert compilation.image, [diagnostic.render() for diagnostic in compilation.diagnostics]
    return compilation.image


def plc_of(way: str, code: Image, dice: Random, monkeypatch: pytest.MonkeyPatch) -> Plc:
    """A PLC with two units, on one network or on one each."""
    plc = Plc(code, dice.choice([1, 10]) * 1_000_000, engine="python" if way == "in Python" else "native")
    timing, filler = dice.choice(["exact", "real"]), dice.choice([0, None, 0xAA])
    networks = [network(dice) for _ in range(dice.randint(1, UNITS))]
    with monkeypatch.context() as patched:
        if way in ("beside", "in Python"):
            patched.setattr(native, "available", lambda: False)
        units = [Etn21(number, f"192.168.250.{number + 1}", timing=timing, seed=number, odd_filler=filler)
                 for number in range(UNITS)]  # fmt: skip
        for unit in units if way != "inside" else ():  # the others switch themselves on when there is something to do
            unit.faults.clear()
    for unit in units:
        plc.attach(unit, networks[unit.layout.bit % len(networks)])
    if way == "looked into":
        plc.phases.append(lambda plc, phase: None)
    return plc


def network(dice: Random) -> LoopNetwork:
    slow = NetFault(latency_ns=2_000_000, jitter_ns=3_000_000)
    cut = NetFault(segment_bytes=dice.choice([1, 100, 700]), random_cut=True, gap_ns=1000)
    found = LoopNetwork(dice.randrange(1000), faults=dice.choice([[], [slow], [cut]]))
    for port, peer in ANSWERS.items():
        found.place(Peer(HOST, port), peer())
    return found


def act(plc: Plc, dice: Random) -> None:
    """What somebody does between scans, and then some scans."""
    unit: Any = plc.units[dice.randrange(UNITS)].unit
    what, value = dice.randrange(16), dice.randrange(65536)
    if what == 0:
        unit.faults.append(Fault(0x2211, dice.choice([None, Switch.SEND])))
    elif what == 1:
        unit.link_up = not unit.link_up
    elif what == 2:
        unit.error_status = value
    elif what == 3:
        plc.mode = Mode.PROGRAM
        plc.scan()
        plc.mode = Mode.RUN
    elif what == 4:
        plc.warm_start()
    elif what == 5:
        plc.cold_start()
    elif what == 6:
        plc.write(f"CIO {dice.randrange(1500, 1550)}", value)
    plc.run(scans=dice.choice([1, 2, 30, 200]))


@pytest.mark.slow
@pytest.mark.parametrize("seed", first_quick(range(times(16))))
@pytest.mark.parametrize("address", ADDRESSES)
def test_all_ways_are_the_same(seed: int, address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    dice = Random(seed)
    values = {"seed": seed, "every": dice.choice([1, 2, 20]), "size": dice.choice([13, 300, 2100])}
    code = image(**values, address=ADDRESSES[address])
    rigs = [(plc_of(way, code, Random(seed), monkeypatch), Random(seed)) for way in WAYS]
    for _ in range(12):
        for plc, dice in rigs:
            act(plc, dice)
        states = [(bytes(plc.memory.u8), plc.now_ns, plc.scans, plc.due_ns) for plc, _ in rigs]
        assert states[1:] == states[:1] * 3
