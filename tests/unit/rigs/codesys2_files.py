"""Files of CODESYS 2.3 of our own making: exports as text with their diagrams, and a library in the form that libraries were
found to have."""

from __future__ import annotations

import struct

EXPORT = """
(* @NESTEDCOMMENTS := 'Yes' *)
(* @PATH := '\\/Motors' *)
(* @OBJECTFLAGS := '0, 8' *)
(* @SYMFILEFLAGS := '2048' *)
FUNCTION_BLOCK Doubler
VAR_INPUT IN : INT; END_VAR
VAR_OUTPUT OUT : INT; END_VAR
(* @END_DECLARATION := '0' *)
OUT := IN * Factor;
Count;
END_FUNCTION_BLOCK

ACTION Count:
Calls := Calls + 1;
END_ACTION
(* @NESTEDCOMMENTS := 'Yes' *)
(* @PATH := '' *)
PROGRAM PLC_PRG
VAR d : Doubler; r : INT; END_VAR
(* @END_DECLARATION := '0' *)
d(IN := r + 1);
r := d.OUT;
END_PROGRAM

(* @NESTEDCOMMENTS := 'Yes' *)
(* @GLOBAL_VARIABLE_LIST := 'Settings' *)
(* @PATH := '' *)
VAR_GLOBAL
    Factor : INT := 2;
    Calls : INT;
END_VAR
(* @OBJECT_END := 'Settings' *)
(* @CONNECTIONS := Settings
FILENAME : ''
NUMOFCONNECTIONS : 0
*)

_ALARMCONFIG
_ALARMCLASSNAME : 'DEFAULT'
_END_ALARMCONFIG

LIBRARY
\\\\.host\\Standard.lib 4.10.05 12:14:46
NumOfPOUs: 1
TON: 0
END_LIBRARY

PLC_CONFIGURATION
_MODULE: '3S'
PLC_END

RESOURCE
TASK Fast (INTERVAL := T#1ms)
END_RESOURCE
"""
VARIABLES = "a, b, c, p, q : BOOL; n, m, k : INT; t : TON; d : Double;"
DOUBLE = ("FUNCTION_BLOCK Double\nVAR_INPUT x : INT; more : BOOL; END_VAR\nVAR_OUTPUT y : INT; odd : BOOL; END_VAR\n"
          "y := x * 2; odd := more;\nEND_FUNCTION_BLOCK\n")


def contact(name: str, sign: str = "_POSITIV") -> str:
    return f"_LD_CONTACT {name} _EXPRESSION {sign}"


def row(word: str, *parts: str) -> str:
    return f"_LD_{word} _LD_OPERATOR:{len(parts)} {' '.join(parts)} _EXPRESSION _POSITIV"


def operand(text: str) -> str:
    return f"_OPERAND _EXPRESSION _POSITIV {text}"


def box(name: str, *parts: str, enabled: str = "", sign: str = "_POSITIV") -> str:
    return f"_OPERATOR _BOX_EXPR:{len(parts)} {enabled} {' '.join(parts)} _EXPRESSION {sign} {name}"


def instance(name: str, kind: str, parts: tuple[str, ...], *more: str) -> str:
    return f"_FUNCTIONBLOCK {name} _BOX_EXPR:{len(parts)} {' '.join(parts)} _EXPRESSION _POSITIV {kind} {outputs(*more)}"


def outputs(*coils: str) -> str:
    """Coils as `q`, `-q`, `set q` and `reset q`."""
    signs = {"": "_POSITIV _NO_SET", "-": "_NEGATIV _NO_SET", "set": "_POSITIV _SET", "reset": "_NEGATIV _SET"}
    made = []
    for coil in coils:
        how, _, name = coil.rpartition(" ")
        how, name = ("-", name[1:]) if name.startswith("-") else (how, name)
        made.append(f"_OUTPUT {signs[how]} {name}")
    return f"_OUTPUTS:{len(coils)} {' '.join(made)}"


def rung(value: str, *coils: str, boxes: tuple[str, ...] = ()) -> str:
    return f"_LD_ASSIGN {value} _EXPRESSION _POSITIV ENABLELIST:{len(boxes)} {' '.join(boxes)} ENABLELIST_END {outputs(*coils)}"


def assigned(value: str, *coils: str) -> str:
    return f"_ASSIGN {value} _EXPRESSION _POSITIV {outputs(*coils)}"


def export(*networks: str, language: str = "LD") -> str:
    """An export with PLC_PRG in these networks, whose words stand one a line."""
    written = "\n".join(f"_NETWORK\n\n_COMMENT\n'Says {number}'\n_END_COMMENT\n" + network.replace(":", " : ").replace(" ", "\n")
                        .replace("\n:\n", " : ") for number, network in enumerate(networks))
    return (f"(* @NESTEDCOMMENTS := 'Yes' *)\n{DOUBLE}PROGRAM PLC_PRG\nVAR {VARIABLES} END_VAR\n(* @END_DECLARATION := '0' *)\n"
            f"_{language}_BODY\n_NETWORKS : {len(networks)}\n{written}\nEND_PROGRAM\n")


# --- libraries --------------------------------------------------------------------------------------------------------


def binary_text(text: str) -> bytes:
    return struct.pack("<I", len(text.encode("cp1252"))) + text.encode("cp1252")


def binary_object(name: str, declaration: str, body: str | None = None, kind: int = 0x12) -> bytes:
    head = bytes(17) + b"\xcd" * 8 + b"\2\0" * 8
    made = binary_text(name) + head + binary_text(declaration.replace("\n", "\r\n"))
    return made + (bytes((kind,)) + binary_text(body.replace("\n", "\r\n")) if body is not None else b"") + bytes(20)


LIBRARY = b"CoDeSys+" + bytes(50) + binary_text("VAR_GLOBAL\r\nEND_VAR\r\n") + bytes(40) + b"".join((
    binary_object("Limits", "VAR_GLOBAL CONSTANT\n\tHIGHEST : INT := 5; (* f\xfcr alle *)\nEND_VAR\n"),
    binary_object("Pair", "TYPE Pair :\nSTRUCT\n\ta, b : INT;\nEND_STRUCT\nEND_TYPE\n\n(* a FUNCTION Odd of old *)\n"),
    binary_object("Sum", "(* adds up *)\nFUNCTION Sum : INT\nVAR_INPUT p : Pair; END_VAR\n", "Sum := MIN(p.a + p.b, HIGHEST);"),
    binary_object("Twice", "FUNCTIONBLOCK Twice\nVAR_INPUT n : INT; END_VAR\nVAR_OUTPUT m : INT; END_VAR\n", "m := 2 * n;"),
    binary_object("Demo", "PROGRAM Demo\nVAR x : INT; END_VAR\n", "not text", kind=0x29),
))
