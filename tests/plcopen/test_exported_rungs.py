"""Rungs as they are drawn in a document: elements with their columns and rows, wires, and what is said of them."""

from __future__ import annotations

import pytest
from rows import each_of

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.interchange.markup import Element, parse_markup
from fbvm.interchange.plcopen.write.exporting import Exported, export_xml
from fbvm.interchange.plcopen.write.layout import AXIS, COLUMN, GAP, PIN, ROW, SYMBOL_HEIGHT

HEAD = "VAR a, b, c, d, x, y : BOOL; n, m : INT; t : TON; END_VAR\n"


def exported(body: str, head: str = HEAD, behind: str = "") -> Exported:
    return export_xml([Source("Main.st", f"PROGRAM Main\n{head}{body}\n{behind}\nEND_PROGRAM\n")])


def root(made: Exported) -> Element:
    assert made.text is not None, [found.render() for found in made.diagnostics]
    found = parse_markup(made.text.encode(), "made.xml")
    assert not isinstance(found, Diagnostic)
    return found[1]


def said(made: Exported) -> list[str]:
    """Each message behind the text that it marks."""
    return [f"{each.code} {each.source.text[each.start:each.end]}: {each.message.removeprefix('Main: ')}"
            for each in made.diagnostics]


def drawn(made: Exported) -> list[str]:
    """The elements of the drawings by their numbers.  Contacts, coils and blocks have a column and a row, rails their height in
    rows and the right one its column, too; `<3.Q` is a wire from output Q of element 3."""
    return [_element(child) for ladder in root(made).walk() if ladder.name == "LD" for child in _with_tops(ladder)]


def _with_tops(ladder: Element) -> list[tuple[Element, int]]:
    """The elements of a drawing, each with the y at which its network begins."""
    found, top = [], GAP
    for child in ladder.children:
        if child.name == "leftPowerRail":
            top = _at(child)[1]
        found.append((child, top))
    return found


def _at(element: Element) -> tuple[int, int]:
    place = element.one("position")
    assert place is not None
    return int(place.get("x")), int(place.get("y"))


def _element(placed: tuple[Element, int]) -> str:
    element, top = placed
    number, (x, y) = element.get("localId"), _at(element)
    if element.name == "comment":
        return f"{number} {' / '.join(next(part.text for part in element.walk() if part.name == 'p').splitlines())}"
    if element.name in ("inVariable", "outVariable"):
        return f"{number} {' '.join(element.text.split())}{_wires(element)}"
    if element.name == "leftPowerRail":
        return f"{number} rail {int(element.get('height')) / ROW:g}"
    column = (x - 80) / COLUMN
    if element.name == "rightPowerRail":
        return f"{number} end {column:g} {int(element.get('height')) / ROW:g}{_wires(element)}"
    if element.name != "block":
        marks = [element.get("negated").replace("true", "not").replace("false", ""), element.get("edge"), element.get("storage")]
        row = (y + SYMBOL_HEIGHT // 2 - AXIS - top) / ROW
        return _words(number, element.name, *marks, element.text.strip(), f"{column:g} {row:.3g}") + _wires(element)
    pins = [f"{pin.get('formalParameter')}{_wires(pin)}" for pin in element.walk() if pin.name == "variable"]
    row = (y + PIN - AXIS - top) / ROW
    return _words(number, element.get("typeName"), element.get("instanceName"), f"{column:g} {row:.3g}", *pins)


def _words(*words: str) -> str:
    return " ".join(filter(None, words))


def _wires(element: Element) -> str:
    return "".join(f" <{wire.get('refLocalId')}" + (f".{pin}" if (pin := wire.get("formalParameter")) else "")
                   for wire in element.walk() if wire.name == "connection")


def lie_on_each_other(made: Exported) -> list[tuple[str, str]]:
    """The numbers of elements of which one covers a part of the other."""
    found = []
    for ladder in root(made).walk():
        children = ladder.children if ladder.name == "LD" else []
        boxes = [(child.get("localId"), *_at(child), int(child.get("width")), int(child.get("height"))) for child in children]
        found += [(one, other) for place, (one, x, y, width, height) in enumerate(boxes)
                  for other, left, top, wide, high in boxes[:place]
                  if x < left + wide and left < x + width and y < top + high and top < y + height]
    return found


def rungs(steps: str) -> str:
    return "\n".join(["LADDER", *steps.split(" / "), "END_LADDER"])


@each_of("steps, drawing", [
    ("LD a / ANDNOT b / @AND c / %OR d / OUT x / OUTNOT y",
     "1 rail 3; 2 contact a 0 0 <1; 3 contact not b 1 0 <2; 4 contact rising c 2 0 <3; 5 contact falling d 0 1 <1; 6 coil x "
     "3 0 <4 <5; 7 coil not y 3 2 <4 <5; 8 end 4 3 <6 <7"),
    ("LD a / OR b / OR c / LD d / ORNOT x / ANDLD / SET x / @RSET y",
     "1 rail 4; 2 contact a 0 0 <1; 3 contact b 0 1 <1; 4 contact c 0 2 <1; 5 contact d 1 0 <2 <3 <4; 6 contact not x 1 1 <2 "
     "<3 <4; 7 coil set x 2 0 <5 <6; 8 coil rising reset y 2 3 <5 <6; 9 end 3 4 <7 <8"),
    ("LD a / AND b / LD c / AND d / ORLD / DIFU x / DIFD y",
     "1 rail 3; 2 contact a 0 0 <1; 3 contact b 1 0 <2; 4 contact c 0 1 <1; 5 contact d 1 1 <4; 6 coil rising x 2 0 <3 <5; 7 "
     "coil falling y 2 2 <3 <5; 8 end 3 3 <6 <7"),
    ("LD a / LD b / OR c / LD d / AND x / ORLD / ANDLD / OUT y",
     "1 rail 3; 2 contact a 0 0 <1; 3 contact b 1 0 <2; 4 contact c 1 1 <2; 5 contact d 1 2 <2; 6 contact x 2 2 <5; 7 coil y "
     "3 0 <3 <4 <6; 8 end 4 3 <7"),
    ("LD a / LD b / LD c / OR d / ANDLD / LD x / ORLD / ANDLD / OUT y",
     "1 rail 3; 2 contact a 0 0 <1; 3 contact b 1 0 <2; 4 contact c 2 0 <3; 5 contact d 2 1 <3; 6 contact x 1 2 <2; 7 coil y "
     "3 0 <4 <5 <6; 8 end 4 3 <7"),
    ("LD a / OUT TR0 / AND b / OUT TR1 / AND c / OUT x / LD TR1 / OUT y / LD TR0 / AND d / SET x",
     "1 rail 3; 2 contact a 0 0 <1; 3 contact b 1 0 <2; 4 contact c 2 0 <3; 5 coil x 3 0 <4; 6 coil y 2 1 <3; 7 contact d 1 "
     "2 <2; 8 coil set x 2 2 <7; 9 end 4 3 <5 <6 <8"),
    ("LD a / OUT TR0 / AND b / LD TR0 / AND c / ORLD / OUT x",
     "1 rail 2; 2 contact a 0 0 <1; 3 contact b 1 0 <2; 4 contact c 1 1 <2; 5 coil x 2 0 <3 <4; 6 end 3 2 <5"),
    ("LD a / OUT TR0 / AND b / OR c / OUT x",
     "1 rail 2; 2 contact a 0 0 <1; 3 contact b 1 0 <2; 4 contact c 0 1 <1; 5 coil x 2 0 <3 <4; 6 end 3 2 <5"),
    ("LD a / OUT TR0 / OR c / OR d / OUT x",
     "1 rail 3; 2 contact a 0 0 <1; 3 contact c 0 1 <1; 4 contact d 0 2 <1; 5 coil x 1 0 <2 <3 <4; 6 end 2 3 <5"),
    ("LD a / OUT TR0 / LD b / OR c / LD TR0 / ORLD / OUT x",
     "1 rail 3; 2 contact a 0 0 <1; 3 contact b 0 1 <1; 4 contact c 0 2 <1; 5 coil x 1 1 <3 <4 <2; 6 end 2 3 <5"),
    ("LD a / OUT x / ANDNOT b / OUT y",
     "1 rail 2; 2 contact a 0 0 <1; 3 coil x 1 0 <2; 4 contact not b 1 1 <2; 5 coil y 2 1 <4; 6 end 3 2 <3 <5"),
    ("LD a / OR b / NOT / AND c / UP / OUT x",
     "1 rail 2; 2 contact a 0 0 <1; 3 contact b 0 1 <1; 4 NOT 1 0 IN <2 <3 OUT; 5 contact c 2 0 <4.OUT; 6 R_TRIG Edge1 3 0 "
     "CLK <5 Q; 7 coil x 4 0 <6.Q; 8 end 5 2 <7"),
    ("LD a / LD b / KEEP x",
     "1 rail 2; 2 contact a 0 0 <1; 3 coil set x 1 0 <2; 4 contact b 0 1 <1; 5 coil reset x 1 1 <4; 6 end 2 2 <3 <5"),
    ("LD a / AND b / LD c / OR d / KEEP x",
     "1 rail 3; 2 contact a 0 0 <1; 3 contact b 1 0 <2; 4 coil set x 2 0 <3; 5 contact c 0 1 <1; 6 contact d 0 2 <1; 7 coil "
     "reset x 1 1 <5 <6; 8 end 3 3 <4 <7"),
    ("LD a / OUT TR0 / AND b / LD c / KEEP x",
     "1 rail 2; 2 contact a 0 0 <1; 3 contact b 1 0 <2; 4 coil set x 2 0 <3; 5 contact c 0 1 <1; 6 coil reset x 1 1 <5; 7 "
     "end 3 2 <4 <6"),
    ("LD a / AND> n &5 / OUT x",
     "1 rail 3; 2 contact a 0 0 <1; 3 n; 4 5; 5 GT 2 1 IN1 <3 IN2 <4 OUT; 6 AND 3 0 IN1 <2 IN2 <5.OUT OUT; 7 coil x 4 0 "
     "<6.OUT; 8 end 5 3 <7"),
    ("LD<S n -5 / OR<>L n m / AND= n #1A / OUT x",
     "1 rail 6; 2 n; 3 -5; 4 LT 1 1 IN1 <2 IN2 <3 OUT; 5 n; 6 m; 7 NE 1 4 IN1 <5 IN2 <6 OUT; 8 n; 9 16#1A; 10 EQ 4 1 IN1 <8 "
     "IN2 <9 OUT; 11 AND 5 0 IN1 <4.OUT <7.OUT IN2 <10.OUT OUT; 12 coil x 6 0 <11.OUT; 13 end 7 6 <12"),
    ("LD a / LD b / AND>= n m / LD c / ORLD / ANDLD / OUT x",
     "1 rail 4; 2 contact a 0 0 <1; 3 contact b 1 0 <2; 4 n; 5 m; 6 GE 3 1 IN1 <4 IN2 <5 OUT; 7 AND 4 0 IN1 <3 IN2 <6.OUT "
     "OUT; 8 contact c 1 3 <2; 9 coil x 5 0 <7.OUT <8; 10 end 6 4 <9"),
    ("LD P_On / OUT x",
     "1 rail 1; 2 coil x 0 0 <1; 3 end 1 1 <2"),
    ("LD P_On / AND a / AND P_on / OUT x",
     "1 rail 1; 2 contact a 0 0 <1; 3 coil x 1 0 <2; 4 end 2 1 <3"),
    ("LDNOT P_Off / OUT x",
     "1 rail 1; 2 contact not P_Off 0 0 <1; 3 coil x 1 0 <2; 4 end 2 1 <3"),
    ("LD a / MOV n m / @MOV &7 n / AND b / OUT x",
     "1 rail 5; 2 contact a 0 0 <1; 3 n; 4 m; 5 MOV 2 0 EN <2 OP1 <3 OP2 <4 ENO; 6 &7; 7 n; 8 MOV 2 2 EN <2 OP1 <6 OP2 <7 "
     "ENO; 9 contact b 1 4 <2; 10 coil x 2 4 <9; 11 end 4 5 <10"),
    ("LD a / LD b / CNT 5 #10",
     "1 rail 5; 2 contact a 0 0 <1; 3 contact b 0 2 <1; 4 5; 5 #10; 6 CNT 2 2 EN <2 C2 <3 OP1 <4 OP2 <5 ENO"),
    ("LD a / AND b / LD c / LD d / CNTR 5 #10",
     "1 rail 7; 2 contact a 0 0 <1; 3 contact b 1 0 <2; 4 contact c 0 2 <1; 5 contact d 0 4 <1; 6 5; 7 #10; 8 CNTR 2 4 EN <3 "
     "C2 <4 C3 <5 OP1 <6 OP2 <7 ENO"),
    ("LD a / IL(002) / LD b / OUT x / ILC(003)",
     "1 rail 1; 2 contact a 0 0 <1; 3 IL 2 0 EN <2 ENO; 4 rail 1; 5 contact b 0 0 <4; 6 coil x 1 0 <5; 7 end 2 1 <6; 8 rail "
     "1; 9 ILC 1 0 ENO"),
    ("LD a / FBCALL TON t IN:=* PT:=T#5ms Q=>* ET=>m / AND b / OUT x",
     "1 rail 3; 2 contact a 0 0 <1; 3 T#5ms; 4 TON t 2 0 IN <2 PT <3 Q ET; 5 m <4.ET; 6 contact b 4 2 <4.Q; 7 coil x 5 2 <6; "
     "8 end 6 3 <7"),
    ("LD a / FBCALL TON t IN:=b Q=>c / OUT x",
     "1 rail 3; 2 contact a 0 0 <1; 3 b; 4 TON t 2 0 EN <2 IN <3 ENO Q; 5 c <4.Q; 6 coil x 4 2 <4.ENO; 7 end 5 3 <6"),
    ("LD a / FBCALL TON u IN:=*",
     "1 rail 1; 2 contact a 0 0 <1; 3 TON u 2 0 IN <2 ENO"),
    ("LD T5 / OUT x",
     "1 rail 1; 2 contact T5 0 0 <1; 3 coil x 1 0 <2; 4 end 2 1 <3"),
    ("LD a / OUT x / END",
     "1 rail 1; 2 contact a 0 0 <1; 3 coil x 1 0 <2; 4 end 2 1 <3"),
    ("END / LD a / OUT x",
     "1 rail 1; 2 END 1 0 ENO; 3 rail 1; 4 contact a 0 0 <3; 5 coil x 1 0 <4; 6 end 2 1 <5"),
    ("LD a / NOP / OUT x",
     "1 rail 1; 2 contact a 0 0 <1; 3 coil x 1 0 <2; 4 end 2 1 <3"),
    ("LD a / OUT TR0 / AND b / OUT x / LD TR0 / AND c / FBCALL TON t IN:=*",
     "1 rail 2; 2 contact a 0 0 <1; 3 contact b 1 0 <2; 4 coil x 2 0 <3; 5 contact c 1 1 <2; 6 TON t 3 1 IN <5 ENO; 7 end 6 "
     "2 <4"),
    ("LD a / OUT x / TIM 0 #10 / OUT y",
     "1 rail 4; 2 contact a 0 0 <1; 3 coil x 1 0 <2; 4 0; 5 #10; 6 TIM 2 1 EN <2 OP1 <4 OP2 <5 ENO; 7 coil y 1 3 <2; 8 end 4 "
     "4 <3 <7"),
    ("LD a / OUT TR0 / LD b / AND c / LD TR0 / ORLD / AND= n m / OUT x",
     "1 rail 4; 2 contact a 0 0 <1; 3 contact b 0 1 <1; 4 contact c 1 1 <3; 5 n; 6 m; 7 EQ 3 2 IN1 <5 IN2 <6 OUT; 8 AND 4 1 "
     "IN1 <4 <2 IN2 <7.OUT OUT; 9 coil x 5 1 <8.OUT; 10 end 6 4 <9"),
    ("LD= n &1 / LD= m &2 / ORLD / LD a / ORLD / OUT x",
     "1 rail 7; 2 n; 3 1; 4 EQ 1 1 IN1 <2 IN2 <3 OUT; 5 m; 6 2; 7 EQ 1 4 IN1 <5 IN2 <6 OUT; 8 contact a 0 6 <1; 9 coil x 3 0 "
     "<4.OUT <7.OUT <8; 10 end 4 7 <9"),
    ("LD a / LD b / OUT TR0 / AND c / ORLD / OUT x",
     "1 rail 3; 2 contact b 0 0 <1; 3 contact a 0 1 <1; 4 contact c 1 2 <2; 5 coil x 2 1 <3 <4; 6 end 3 3 <5"),
    ("LD a / OR b / AND c / OR d / OUT x",
     "1 rail 3; 2 contact a 0 0 <1; 3 contact b 0 1 <1; 4 contact c 1 0 <2 <3; 5 contact d 0 2 <1; 6 coil x 2 0 <4 <5; 7 end "
     "3 3 <6"),
    ("LD a / OR b / LD c / OR d / ORLD / OUT x",
     "1 rail 4; 2 contact a 0 0 <1; 3 contact b 0 1 <1; 4 contact c 0 2 <1; 5 contact d 0 3 <1; 6 coil x 1 0 <2 <3 <4 <5; 7 "
     "end 2 4 <6"),
    ("LD a / LD b / OR c / ANDLD / AND d / OR x / OUT y",
     "1 rail 3; 2 contact a 0 0 <1; 3 contact b 1 0 <2; 4 contact c 1 1 <2; 5 contact d 2 0 <3 <4; 6 contact x 0 2 <1; 7 "
     "coil y 3 0 <5 <6; 8 end 4 3 <7"),
    ("LD a / OUT TR0 / AND b / AND c / AND d / OUT TR1 / LD TR0 / OUT x",
     "1 rail 2; 2 contact a 0 0 <1; 3 contact b 1 0 <2; 4 contact c 2 0 <3; 5 contact d 3 0 <4; 6 coil x 1 1 <2; 7 end 5 2 "
     "<6"),
    ("LD a / OUT TR0 / AND b / AND c / AND d / OUT TR1 / LD TR0 / MOV n m",
     "1 rail 3; 2 contact a 0 0 <1; 3 contact b 1 0 <2; 4 contact c 2 0 <3; 5 contact d 3 0 <4; 6 n; 7 m; 8 MOV 2 1 EN <2 "
     "OP1 <6 OP2 <7 ENO"),
    ("LD a / FBCALL Blk f s:='a:=b' k:=n", "1 rail 2; 2 contact a 0 0 <1; 3 'a:=b'; 4 n; 5 Blk f 2 0 EN <2 s <3 k <4 ENO"),
], ids=lambda row: row[0])  # fmt: skip
def test_where_the_elements_of_a_rung_stand_and_what_their_wires_come_from(steps: str, drawing: str) -> None:
    made = exported(rungs(steps))
    assert "; ".join(drawn(made)) == drawing
    assert lie_on_each_other(made) == []


@pytest.mark.slow
def test_as_many_contacts_as_a_rung_has_stand_side_by_side() -> None:
    made = exported(rungs(" / ".join(["LD a", *["OR b"] * 998, "OUT x"])))
    assert drawn(made)[999:] == ["1000 contact b 0 998 <1", "1001 coil x 1 0" + "".join(f" <{at}" for at in range(2, 1001)),
                                  "1002 end 2 999 <1001"]


NO_NAME = "is an address, for which other tools have no name; declare a variable AT it"
NO_INSTRUCTION = "is an instruction that other tools do not have"
NONE = "ladder of PLCopen XML has no"


@each_of("steps, messages", [
    ("LD T5 / ANDNOT P_Off / AND d / OUT D100.03", [f"X0390 LD T5: T5 {NO_NAME}", f"X0390 ANDNOT P_Off: P_Off {NO_NAME}",
                                                    f"X0390 OUT D100.03: D100.03 {NO_NAME}"]),
    ("LD P_On / AND> D7 #5 / OUT x", [f"X0390 AND> D7 #5: D7 {NO_NAME}"]),
    ("LD a / FBCALL CTU u CU:=* PV:=D7 CV=>n / FBCALL CTU u CU:=* PV:=&7 CV=>W5",
     [f"X0390 FBCALL CTU u CU:=* PV:=D7 CV=>n: D7 {NO_NAME}", f"X0390 FBCALL CTU u CU:=* PV:=&7 CV=>W5: W5 {NO_NAME}"]),
    ("LD<=DT n m n / OR=$ n m / AND=SL n m / ANDTST n &3 / AND<D n m / AND>F n m / OUT x",
     [f"X0390 {step}: {name} is a comparison that other tools do not have" for step, name in (
         ("LD<=DT n m n", "<=DT"), ("OR=$ n m", "=$"), ("ANDTST n &3", "TST"))]),
    ("LD a / MOV n m / LD b / MOV m n / TIM 5 #7", [f"X0390 MOV n m: MOV {NO_INSTRUCTION}",
                                                    f"X0390 TIM 5 #7: TIM {NO_INSTRUCTION}"]),
    ("LD a / BPRG 1 / BEND", [f"X0301 BPRG 1: {NONE} block program (BPRG)"]),
    ("@LDNOT a / OUT x", [f"X0301 @LDNOT a: {NONE} contact that is negated and has an edge"]),
    ("LD a / OR P_On / OUT x", [f"X0301 OR P_On: {NONE} wire that bridges contacts"]),
    ("LD a / OUT TR0 / AND b / LD TR0 / AND c / ANDLD / OUT x",
     [f"X0301 ANDLD: {NONE} AND of two places from which something else hangs"]),
    ("LD a / LD b / LD c / LD X / OR d / ORLD / ANDLD / KEEP x", [f"X0301 KEEP x: {NONE} KEEP whose reset asks for its own bit"]),
    ("LD a / OUT TR0 / AND b / LD TR0 / KEEP x", [f"X0301 KEEP x: {NONE} KEEP whose reset asks for its own bit"]),
    ("LD a / OUT TR0 / AND b / LD TR0 / AND c / CNT 5 #10",
     [f"X0301 CNT 5 #10: {NONE} CNT of which two inputs begin at a branch point", f"X0390 CNT 5 #10: CNT {NO_INSTRUCTION}"]),
    ("LD a / DOWN / OUT x", [f"X0301 DOWN: {NONE} DOWN"]),
    ("LD ,IR0 / OUT x", ["X0301 LD ,IR0: an address that is worked out cannot stand here"]),
], ids=lambda row: row[0])  # fmt: skip
def test_what_is_said_of_rungs_that_other_tools_do_not_have(steps: str, messages: list[str]) -> None:
    assert said(exported(rungs(steps))) == messages


def test_a_comparison_that_the_standard_has_no_function_for_is_drawn_under_its_own_name() -> None:
    made = exported(rungs("LD<=DT n m n / AND<>SL n m / ANDTST n &3 / OUT x"))
    assert [one.get("typeName") for one in root(made).walk() if one.name == "block"] == ["<=DT", "NE", "AND", "TST", "AND"]


def declared(made: Exported) -> list[str]:
    """The variables of the program as `name` and `name : type`, where the type is a derived one."""
    return [" : ".join(filter(None, [one.get("name"), *(kind.get("name") for kind in one.walk() if kind.name == "derived")]))
            for one in root(made).walk() if one.name == "variable" and one.get("name")]


UP = "LADDER\n{} a\nUP\nOUT x\nEND_LADDER\n"


@each_of("first, behind, names", [
    (UP.format("LD"), "", ["Edge1 : R_TRIG"]),
    (UP.format("LD a\nUP\nAND"), "", ["Edge1 : R_TRIG", "Edge2 : R_TRIG"]),
    (UP.format("LD"), f"ACTION one:\n{UP.format('LD')}END_ACTION\nACTION two:\n{UP.format('LD')}END_ACTION",
     ["Edge1 : R_TRIG", "Edge2 : R_TRIG", "Edge3 : R_TRIG"]),
    (UP.format("LD edge1\nOR EDGE2\nAND"), "", ["Edge3 : R_TRIG"]),  # variables of the project
    (UP.format("LD"), "ACTION one:\nLADDER\nLD a\nFBCALL TON Edge1 IN:=*\nEND_LADDER\nEND_ACTION",
     ["Edge2 : R_TRIG", "Edge1 : TON"]),
    ("LADDER\nLD a\nFBCALL TON fresh IN:=*\nEND_LADDER\nx := a;\nLADDER\nLD a\nFBCALL TON Fresh IN:=*\nEND_LADDER\n",
     "ACTION one:\nLADDER\nLD a\nFBCALL TON FRESH IN:=*\nEND_LADDER\nEND_ACTION", ["fresh : TON"]),
    ("LADDER\nLD a\nFBCALL TON T IN:=*\nEND_LADDER\n", "", []),
])  # fmt: skip
def test_what_rungs_need_is_declared_once_and_each_edge_has_an_instance_of_its_own(
        first: str, behind: str, names: list[str]) -> None:
    made = exported(first, behind=behind)
    assert declared(made)[HEAD.count(",") + HEAD.count(":"):] == names
    used = [one.get("instanceName") for one in root(made).walk() if one.get("typeName") == "R_TRIG"]
    assert sorted(used) == [name.split()[0] for name in names if "R_TRIG" in name]


def test_a_method_has_no_instance_that_rungs_of_its_block_name() -> None:
    call = "LADDER\nLD a\nFBCALL TON fresh IN:=*\nEND_LADDER\n"
    block = f"FUNCTION_BLOCK Main\n{HEAD}METHOD m\n{call}END_METHOD\n{call}END_FUNCTION_BLOCK\n"
    assert [each.message for each in export_xml([Source("Main.st", block)]).errors] == [
        "Main: the rungs of METHOD m need memory of their own"]


@each_of("body, boxes", [
    ("LADDER\nLD a\nOUT x\nEND\nEND_LADDER", 0), ("LADDER\nLD a\nOUT x\nEND\nLD a\nOUT y\nEND_LADDER", 1),
    ("LADDER\nLD a\nOUT x\nEND\nEND_LADDER\ny := a;", 1), ("y := a;\nLADDER\nLD a\nOUT x\nEND\nEND_LADDER", 0),
])  # fmt: skip
def test_an_end_is_left_out_where_nothing_stands_behind_it(body: str, boxes: int) -> None:
    assert [one.get("typeName") for one in root(exported(body)).walk() if one.name == "block"] == ["END"] * boxes


def test_symbols_of_a_table_are_declared_or_stand_for_their_timers() -> None:
    table = ('Start,0.00,BOOL,,,,"";\nWait,T0007,TIMER,,,,"";\nCount,C0012,COUNTER,,,,"";\nRows,D200,INT[4],,,,"";\n'
             'One,,UINT[1],,,,"";\nMore,,CHANNEL,,,,"";\na,D3,BOOL,,,,"";\n')
    steps = "RUNG 1 first\n// second\n' third\nLD Start\nANDNOT wait\nAND= More Wait\nMOV Count Rows"
    made = exported(f"LADDER\n{table}{steps}\nEND_LADDER")
    places = [_words(one.get("name"), *(part.name for part in one.walk() if part.name.isupper()),
                     *(f"{part.get('lower')}..{part.get('upper')}" for part in one.walk() if part.name == "dimension"),
                     *(part.text.strip() for part in one.walk() if part.name == "text"))
              for one in root(made).walk() if one.name == "variable" and one.get("name")]
    assert places[-4:] == ["Start BOOL CIO 0.00", "Rows INT 0..3 D200", "One UINT 0..0", "More WORD"]
    assert drawn(made) == [
        "1 first / second / third", "2 rail 3", "3 contact Start 0 0 <2", "4 contact not T7 1 0 <3", "5 More", "6 T7",
        "7 EQ 3 1 IN1 <5 IN2 <6 OUT", "8 AND 4 0 IN1 <4 IN2 <7.OUT OUT", "9 C12", "10 Rows",
        "11 MOV 6 0 EN <8.OUT OP1 <9 OP2 <10 ENO"]
    assert said(made) == [f"X0390 {marked}: the address {place} is kept as data of this program; other tools place the variable"
                          for marked, place in (("Start", "CIO 0.00"), ("Rows", "D200"))] + [
        f"X0390 ANDNOT wait: T7 {NO_NAME}", f"X0390 MOV Count Rows: MOV {NO_INSTRUCTION}"]


def test_a_timer_of_each_instance_has_no_name_in_other_tools() -> None:
    made = exported('LADDER\nOwn,,TIMER,,,,"";\nRUNG 1\nLD a\nOUT x\nEND_LADDER')
    assert [(each.message, each.hint) for each in made.diagnostics] == [
        ("Main: Own is a timer of each instance, for which other tools have no name",
         "give it a number, as in Own,T0005,TIMER,,,,")]
