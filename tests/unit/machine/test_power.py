"""Power in rungs as machine code notes it: the same as the recorder sees, on every engine, of every instance."""

from __future__ import annotations

import pytest

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.engine.choice import tiers
from fbvm.engine.choice.tiers import TieredEngine
from fbvm.engine.native import engine as native
from fbvm.engine.native.code import code_of
from fbvm.engine.powered import powered
from fbvm.machine.counting import counting
from fbvm.machine.plc import Phase, Plc
from fbvm.machine.power import Power, powering
from fbvm.record.draw.power import PowerFlow, latest_execution
from fbvm.record.trace.events import Contact, Event
from fbvm.record.trace.observing import observing
from fbvm.watch.paths import Place, UnknownPlace

TEXT = """FUNCTION_BLOCK Pump
VAR_INPUT Start, Stop : BOOL; END_VAR
VAR_OUTPUT Run : BOOL; END_VAR
LADDER
    LD Start
    OR Run
    ANDNOT Stop
    OUT Run
END_LADDER
END_FUNCTION_BLOCK
PROGRAM Main
VAR pumps : ARRAY[0..2] OF Pump; single : Pump; i : INT; END_VAR
    FOR i := 0 TO 2 DO
        pumps[i](Start := i = 1, Stop := FALSE);
    END_FOR;
    IF %D5 = 1 THEN single(Start := TRUE, Stop := %W0.03); END_IF;
    LADDER
        LD 0.00
        ANDNOT 0.01
        OUT 100.00
    END_LADDER
END_PROGRAM"""
RUNGS = """PROGRAM Main
VAR n : INT; END_VAR
LADDER
    LD 0.00
    ANDNOT 0.01
    OUT 100.00
    LD P_First_Cycle
    OUT 100.01
END_LADDER
END_PROGRAM"""
MANY = """PROGRAM Main
VAR a, b : BOOL; END_VAR
LADDER
    LD W0.00
    AND W0.01
    AND W0.02
    AND W0.03
    ANDNOT W0.04
    AND W0.05
    OR W0.06
    OR W0.07
    OR W0.00
    OUT a
    LDNOT W0.07
    OUT W0.06
    LD a
    OR b
    LD W0.03
    AND W0.06
    ORLD
    AND=(300) W1 #3
    OUT b
    OUTNOT W2.00
    LD b
    AND W2.00
    SET W0.03
END_LADDER
END_PROGRAM"""
"""All bits of a byte, one of them twice, one that a rung writes between two that read it, and a comparison."""
ENGINES = ["python", pytest.param("native", marks=pytest.mark.skipif(not native.available(), reason="llvmlite is not installed"))]
INSTANCES = ["Main", "Main.pumps[0]", "Main.pumps[1]", "Main.pumps[2]", "Main.single"]


def image(text: str) -> Image:
    made = compile_text(text).image
    assert made is not None
    return made


class Seen:
    """Keeps the latest state of each element that a listener hears of, by instance."""

    def __init__(self) -> None:
        self.states: dict[int, dict[tuple[int, object], bool]] = {}

    def phase(self, plc: Plc, phase: Phase) -> None:
        """Does nothing."""

    def event(self, plc: Plc, event: Event) -> None:
        """Keeps the state of an element."""
        if isinstance(event, Contact):
            self.states.setdefault(event.frame.base, {})[event.site, event.element] = event.value


def press(plc: Plc, scan: int) -> None:
    """What is given from outside before a scan."""
    plc.write("CIO 0.00", scan >= 2)
    plc.write("CIO 0.01", scan == 4)
    plc.write("D5", int(scan in (1, 2, 3)))
    plc.write("W0.03", scan == 3)


def known(power: Power, names: list[str]) -> dict[int, dict[tuple[int, object], bool]]:
    found = {power.body(name)[1]: power.elements(name) for name in names}
    return {base: states for base, states in found.items() if states}


@pytest.mark.parametrize("engine", ENGINES)
def test_it_is_what_the_recorder_sees(engine: str) -> None:
    made = image(TEXT)
    plc, observed, seen = Plc(made, engine=engine), Plc(made, engine="python"), Seen()
    with powering(plc) as power, observing(observed, seen):
        for scan in range(6):
            power.forget()
            seen.states.clear()
            for one in (plc, observed):
                press(one, scan)
                one.scan()
            assert known(power, INSTANCES) == seen.states
            assert bool(power.elements("Main.single")) == (scan in (1, 2, 3))
    assert bytes(plc.memory.u8) == bytes(observed.memory.u8)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
def test_contacts_that_share_a_byte_are_told_apart(engine: str) -> None:
    made = image(MANY)
    plc, observed, seen = Plc(made, engine=engine), Plc(made, engine="python"), Seen()
    with powering(plc) as power, observing(observed, seen):
        for scan, word in enumerate([0, 0xFF, 0x2F, 0x3F, 0x40, 0x80, 0xC9, 0x10, 0x08]):
            for one in (plc, observed):
                one.write("W0", word)
                one.write("W1", scan % 4)
                one.scan()
            assert known(power, ["Main"]) == seen.states
    marks = powered(made).bodies[power.body("Main")[0]]
    assert (marks.marks, len(marks.elements)) == (11, 22)


@pytest.mark.parametrize("engine", ENGINES)
def test_the_latest_evaluation_stays_known(engine: str) -> None:
    plc = Plc(image(RUNGS), engine=engine)
    with powering(plc) as power:
        assert power.elements("Main") == {}
        plc.write("CIO 0.00", True)
        plc.run(scans=100)
        states = list(power.elements("Main").values())
        assert states == [True, True, True, False, False]
        power.forget()
        assert power.elements("Main") == {}
        plc.scan()
        assert list(power.elements("Main").values()) == states


def test_rungs_are_drawn_of_it() -> None:
    plc, flow = Plc(image(RUNGS)), Plc(image(RUNGS))
    listener = PowerFlow(flow.image.rungs, lambda scan: True)
    with powering(plc) as power, observing(flow, listener):
        for one in (plc, flow):
            one.write("CIO 0.00", True)
            one.scan()
        _, base = power.body("Main")
        drawn = [latest_execution(rung, base, 0, power.elements("Main")) for rung in plc.image.rungs]
        assert [(made.picture.number, made.states) for made in drawn if made] == [
            (made.picture.number, made.states) for made in listener.executed]
        power.forget()
        assert latest_execution(plc.image.rungs[0], base, 0, power.elements("Main")) is None


@pytest.mark.skipif(not native.available(), reason="llvmlite is not installed")
def test_it_survives_the_change_to_machine_code(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tiers, "STATEMENTS_TO_PAY", 20)
    made = image(RUNGS)
    kept = code_of(powered(made).image)
    kept.prepare(2)
    plc = Plc(made, engine="auto")
    with powering(plc) as power:
        plc.scan()
        assert list(power.elements("Main").values()) == [False, True, False, True, True]
        plc.write("CIO 0.00", True)
        plc.run(scans=40)
        assert isinstance(plc.engine, TieredEngine) and plc.engine.native
        assert list(power.elements("Main").values()) == [True, True, True, False, False]


def test_what_is_no_instance_is_said_so() -> None:
    plc = Plc(image(TEXT))
    with powering(plc) as power:
        with pytest.raises(UnknownPlace, match=r"Main\.i is no program and no instance"):
            power.elements("Main.i")
        with pytest.raises(UnknownPlace):
            power.elements("Main.nobody")
        with pytest.raises(ValueError, match="counts or notes power already"), counting(plc):
            pass
    place = plc.find("Main")
    assert isinstance(place, Place)


@pytest.mark.slow
def test_an_instance_without_rungs_has_no_elements() -> None:
    image = compile_text(RUNGS.replace("n : INT;", "t : TON;").replace("LADDER\n", "t();\nLADDER\n", 1)).image
    assert image is not None
    plc = Plc(image)
    with powering(plc) as power:
        plc.scan()
        assert power.elements("Main.t") == {} and len(power.elements("Main")) == 5


IN_STATEMENTS = """PROGRAM Main
VAR a, b, c, d : BOOL; n, i : INT; END_VAR
    n := n + 1; b := n MOD 2 = 0; c := n > 2;
    CASE n MOD 3 OF
        0: a := b AND c;
        1: a := b OR c;
    ELSE
        d := NOT b;
    END_CASE;
    FOR i := 1 TO 3 DO d := a AND i > 2; END_FOR
    d := b XOR c; a := NOT (b = (c XOR d));
    WHILE c DO c := d AND NOT c; END_WHILE
    REPEAT b := c; UNTIL TRUE END_REPEAT
END_PROGRAM"""


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
def test_contacts_of_statements_inside_others_have_their_power(engine: str) -> None:
    made = compile_text(IN_STATEMENTS, drawn=True).image
    assert made is not None
    plc, observed, seen = Plc(made, engine=engine), Plc(made, engine="python"), Seen()
    with powering(plc) as power, observing(observed, seen):
        for _ in range(7):
            power.forget()
            seen.states.clear()
            plc.scan()
            observed.scan()
            assert known(power, ["Main"]) == seen.states != {}
