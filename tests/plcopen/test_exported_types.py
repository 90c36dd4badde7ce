"""Declarations as elements of a document: types, values, addresses, sections, remarks, and what has no form there."""

from __future__ import annotations

from rows import each_of
from test_exported_rungs import exported, root, said

from fbvm.base.diagnostics import Source
from fbvm.interchange.markup import Element
from fbvm.interchange.plcopen.write.exporting import Exported, export_xml

TYPES = "FUNCTION_BLOCK B END_FUNCTION_BLOCK TYPE Own : INT; Main_n : INT; END_TYPE\n"


def program(declared: str) -> Exported:
    return export_xml([Source("Main.st", f"{TYPES}PROGRAM Main\n{declared}\n;\nEND_PROGRAM\n")])


def short(element: Element) -> str:
    """An element as `name[values of attributes](elements inside)`, and its own text in apostrophes."""
    marks = ", ".join(element.attributes.values())
    inside = " ".join(map(short, element.children)) or (f"'{element.text.strip()}'" if element.text.strip() else "")
    return element.name + (f"[{marks}]" if marks else "") + (f"({inside})" if inside else "")


def inside(made: Exported, name: str) -> str:
    """The elements inside the last element of a name."""
    return " ".join(map(short, [one for one in root(made).walk() if one.name == name][-1].children))


@each_of("declared, elements", [
    ('a : date_and_time; b : TIME_OF_DAY; c : Int; d : LTIME; e : Own; f : DT;',
     'variable[a](type(DT)) variable[b](type(TOD)) variable[c](type(INT)) variable[d](type(derived[LTIME])) '
     'variable[e](type(derived[Own])) variable[f](type(DT))'),
    ('a : STRING; b : STRING[8]; c : WSTRING[2 * 3]; d : WSTRING;',
     'variable[a](type(string)) variable[b](type(string[8])) variable[c](type(wstring[2 * 3])) variable[d](type(wstring))'),
    ('a : ARRAY[0..3, -1..(1 + 2)] OF ARRAY[1..2] OF BOOL; b : POINTER TO ARRAY[0..1] OF INT;',
     'variable[a](type(array(dimension[0, 3] dimension[-1, 1 + 2] baseType(array(dimension[1, 2] baseType(BOOL)))))) '
     'variable[b](type(pointer(baseType(array(dimension[0, 1] baseType(INT))))))'),
    ('a : REFERENCE TO INT; b : REFERENCE TO B();',
     'variable[a](type(derived[REFERENCE TO INT])) variable[b](type(derived[REFERENCE TO B]))'),
    ('a : ARRAY[0..1] OF UINT(1..3); b : ARRAY[0..1] OF INT(-5..3); c : ARRAY[0..1] OF (X, Y := 3) WORD;',
     'variable[a](type(array(dimension[0, 1] baseType(subrangeUnsigned(range[1, 3] baseType(UINT)))))) '
     'variable[b](type(array(dimension[0, 1] baseType(subrangeSigned(range[-5, 3] baseType(INT)))))) '
     'variable[c](type(array(dimension[0, 1] baseType(enum(values(value[X] value[Y, 3]) baseType(WORD))))))'),
    ('a : STRUCT x, y : INT := 3; z : STRING; END_STRUCT;',
     'variable[a](type(struct(variable[x](type(INT) initialValue(simpleValue[3])) variable[y](type(INT) '
     'initialValue(simpleValue[3])) variable[z](type(string)))))'),
    ("a : ARRAY[0..9] OF INT := [2(7), 1, 7(INT#2)]; b : B := (x := 3, y := (z := [1, 2])); c : STRING := 'a  $'b';",
     'variable[a](type(array(dimension[0, 9] baseType(INT))) initialValue(arrayValue(value[2](simpleValue[7]) '
     'value(simpleValue[1]) value[7](simpleValue[INT#2])))) variable[b](type(derived[B]) '
     'initialValue(structValue(value[x](simpleValue[3]) value[y](structValue(value[z](arrayValue(value(simpleValue[1]) '
     "value(simpleValue[2])))))))) variable[c](type(string) initialValue(simpleValue['a  $'b']))"),
    ('a AT %IX0.3 : BOOL; b AT %q* : BOOL; c AT %MD10 : DWORD; d AT D100 : INT; e AT %MW1.2.3 : WORD := 3; f AT T5 : BOOL;',
     'variable[a, %IX0.3](type(BOOL)) variable[b, %q*](type(BOOL)) variable[c, %MD10](type(DWORD)) variable[d](type(INT) '
     "addData(data[urn:fbvm:location, discard](text('D100')))) variable[e, %MW1.2.3](type(WORD) "
     "initialValue(simpleValue[3])) variable[f](type(BOOL) addData(data[urn:fbvm:location, discard](text('T5'))))"),
    ('a : INT; // first\n b, c : INT; ; //both \n d : INT := 3; e : INT; (* none *)',
     "variable[a](type(INT) documentation(p('first'))) variable[b](type(INT) documentation(p('both'))) variable[c](type(INT)"
     " documentation(p('both'))) variable[d](type(INT) initialValue(simpleValue[3])) variable[e](type(INT))"),
    ('a : B(1, n := 2); b : ARRAY[0..1] OF ARRAY[0..1] OF B(k); c : B(); d : B;',
     'variable[a](type(derived[B]) addData(data[http://www.3s-software.com/plcopenxml/inputassignments, '
     "implementation](InputAssignments(InputAssignment(Value('1')) InputAssignment(Name('n') Value('2')))))) "
     'variable[b](type(array(dimension[0, 1] baseType(array(dimension[0, 1] baseType(derived[B]))))) '
     'addData(data[http://www.3s-software.com/plcopenxml/inputassignments, '
     "implementation](InputAssignments(InputAssignment(Value('k')))))) variable[c](type(derived[B])) "
     'variable[d](type(derived[B]))'),
    ("a : INT := (2 + 3) * (4 - (* two *) 2); b : INT := 2 + (3 * (4 + 1)); c : BOOL := (')' = '('); d : INT := ((1));",
     'variable[a](type(INT) initialValue(simpleValue[(2 + 3) * (4 - 2)])) variable[b](type(INT) initialValue(simpleValue[2 +'
     " (3 * (4 + 1))])) variable[c](type(BOOL) initialValue(simpleValue[')' = '('])) variable[d](type(INT) "
     'initialValue(simpleValue[1]))'),
], ids=lambda row: row[0])  # fmt: skip
def test_variables_as_elements(declared: str, elements: str) -> None:
    assert inside(program(f"VAR {declared} END_VAR"), "localVars") == elements


@each_of("declared, types, variables", [
    ("n : INT(0..9); b : USINT(1..2) := 1;",
     "dataType[Main_n_2](baseType(subrangeSigned(range[0, 9] baseType(INT)))) "
     "dataType[Main_b](baseType(subrangeUnsigned(range[1, 2] baseType(USINT))))",
     "variable[n](type(derived[Main_n_2])) variable[b](type(derived[Main_b]) initialValue(simpleValue[1]))"),
    ("a, b : (On, Off := 4) := Off; c : (X) UINT; d : WORD (Y := 3, Z);",
     "dataType[Main_a](baseType(enum(values(value[On] value[Off, 4])))) "
     "dataType[Main_c](baseType(enum(values(value[X]) baseType(UINT)))) "
     "dataType[Main_d](baseType(enum(values(value[Y, 3] value[Z]) baseType(WORD))))",
     "variable[a](type(derived[Main_a]) initialValue(simpleValue[Off])) "
     "variable[b](type(derived[Main_a]) initialValue(simpleValue[Off])) "
     "variable[c](type(derived[Main_c])) variable[d](type(derived[Main_d]))"),
])  # fmt: skip
def test_an_enumeration_and_a_subrange_of_a_variable_become_types_with_names(declared: str, types: str, variables: str) -> None:
    made = program(f"VAR {declared} END_VAR")
    assert inside(made, "dataTypes") == f"dataType[Own](baseType(INT)) dataType[Main_n](baseType(INT)) {types}"
    assert inside(made, "localVars") == variables


def test_sections_and_their_qualifiers() -> None:
    made = program("VAR RETAIN a : INT; END_VAR VAR CONSTANT b : INT; END_VAR VAR PERSISTENT RETAIN c : INT; END_VAR "
                   "VAR NON_RETAIN d : INT; END_VAR VAR_TEMP e : INT; END_VAR VAR_EXTERNAL f : INT; END_VAR "
                   "VAR_INPUT g : INT; END_VAR VAR_OUTPUT h : INT; END_VAR VAR_IN_OUT i : INT; END_VAR VAR_STAT j : INT; END_VAR")
    heads = [*["localVars"] * 4, "tempVars", "externalVars", "inputVars", "outputVars", "inOutVars", "globalVars"]
    marks = ["retain", "constant", "persistent retain", "nonretain", "", "", "", "", "", ""]
    found = [one for one in root(made).walk() if one.name == "interface"][-1].children
    assert [(one.name, " ".join(one.attributes), short(one.children[0])) for one in found] == [
        (head, mark, f"variable[{name}](type(INT))") for head, mark, name in zip(heads, marks, "abcdefghij", strict=True)]
    assert {value for one in found for value in one.attributes.values()} == {"true"}


LOCATION = "the address {} is kept as data of this program; other tools place the variable"
INIT = "what the variable gives FB_init is kept as CODESYS has it; other tools do not read it"


@each_of("declared, messages", [
    ("VAR a AT D100 : INT; b AT %MW1 : INT; c AT %MW1 : INT; d AT W5 : INT; END_VAR",
     [f"X0390 {place}: {LOCATION.format(place)}" for place in ("D100", "W5")]),
    ("VAR a : REFERENCE TO INT; END_VAR",
     ["X0390 REFERENCE TO INT: REFERENCE TO is written as CODESYS has it, as the name of a type"]),
    ("VAR a : REFERENCE TO ARRAY[0..1] OF INT; END_VAR",
     ["X0301 REFERENCE TO ARRAY[0..1] OF INT: the format has no type for REFERENCE TO ARRAY[0..1] OF INT"]),
    ("VAR a : REF_TO INT; END_VAR", ["X0301 REF_TO INT: the format has no type for REF_TO INT"]),
    ("VAR a : ARRAY[*] OF INT; END_VAR", ["X0301 ARRAY[*] OF INT: the format has no arrays of any length"]),
    ("VAR a : STRUCT OVERLAP b : INT; END_STRUCT; END_VAR",
     ["X0301 STRUCT OVERLAP b : INT; END_STRUCT: the format has no type for STRUCT OVERLAP b : INT; END_STRUCT"]),
    ("VAR a : ARRAY[0..3] OF INT := [4()]; END_VAR", ["X0301 [4()]: the format cannot repeat a default value"]),
    ("VAR a : B(1); END_VAR", [f"X0390 B(1): {INIT}"]), ("VAR a : B(); b : B; END_VAR", []),
    ("VAR_INST a : INT; END_VAR", ["X0301 VAR_INST a : INT; END_VAR: the format has no VAR_INST"]),
    ("VAR_STAT a : INT; END_VAR",
     ["X0390 VAR_STAT a : INT; END_VAR: VAR_STAT is written as CODESYS and TwinCAT have it; other tools do not read it"]),
    ("VAR PRIVATE a : INT; END_VAR", ["X0301 PRIVATE: the format has no PRIVATE"]),
    ("VAR_INPUT a : BOOL F_EDGE; END_VAR", ["X0301 a : BOOL F_EDGE;: the format has no R_EDGE and F_EDGE"]),
])  # fmt: skip
def test_what_is_said_of_declarations_that_other_tools_do_not_have(declared: str, messages: list[str]) -> None:
    assert said(program(declared)) == messages


def test_a_name_for_an_enumeration_is_free_in_all_sources() -> None:
    behind = ("END_PROGRAM TYPE main_E : INT; MAIN_e_2 : INT; END_TYPE VAR_GLOBAL e : (Up, Down); END_VAR "
              "PROGRAM Next VAR e : (Left, Right); END_VAR")
    made = exported("", "VAR e : (On, Off); f : INT(0..1); END_VAR", behind)
    assert [one.get("name") for one in root(made).walk() if one.name == "dataType"] == [
        "main_E", "MAIN_e_2", "Main_e_3", "Main_f", "e_type", "Next_e"]
