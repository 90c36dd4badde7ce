"""The page of a standard function: what it does, and its parameters as a declaration would have them."""

from __future__ import annotations

from fbvm.base.types import fold
from fbvm.check.calls.functions import (
    EXTENSIBLE_OPERATORS,
    OPERATORS,
    OTHER_NAMES,
    SIGNATURES,
    TIME_OPERATORS,
    Conversion,
    Signature,
    conversion,
    typed_name,
)

MEANINGS = {
    "ABS": "IN without its sign.",
    "SQRT": "The square root of IN.",
    "LN": "The natural logarithm of IN.",
    "LOG": "The logarithm of IN to base 10.",
    "EXP": "e to the power of IN.",
    "SIN": "The sine of IN, which is in radians.",
    "COS": "The cosine of IN, which is in radians.",
    "TAN": "The tangent of IN, which is in radians.",
    "ASIN": "The arc sine of IN, in radians.",
    "ACOS": "The arc cosine of IN, in radians.",
    "ATAN": "The arc tangent of IN, in radians.",
    "ATAN2": "The angle of the point (X, Y), in radians from -pi to pi.",
    "MOVE": "IN as it is, as := assigns it.",
    "SHL": "IN shifted to the left by N bits; zeros come in from the right.",
    "SHR": "IN shifted to the right by N bits; zeros come in from the left.",
    "ROL": "IN rotated to the left by N bits: what leaves on the left comes in on the right.",
    "ROR": "IN rotated to the right by N bits: what leaves on the right comes in on the left.",
    "SEL": "IN0 if G is FALSE, IN1 if it is TRUE.",
    "MAX": "The greatest of the inputs.",
    "MIN": "The least of the inputs.",
    "LIMIT": "IN, but at least MN and at most MX.",
    "MUX": "The input with number K, IN0 for 0.",
    "GT": "TRUE if each input is greater than the next one.",
    "GE": "TRUE if each input is greater than or equal to the next one.",
    "LE": "TRUE if each input is less than or equal to the next one.",
    "LT": "TRUE if each input is less than the next one.",
    "EQ": "TRUE if all inputs are equal.",
    "NE": "TRUE if both inputs differ.",
    "LEN": "The number of characters of IN.",
    "LEFT": "The first L characters of IN.",
    "RIGHT": "The last L characters of IN.",
    "MID": "L characters of IN from position P on; the first one has position 1.",
    "CONCAT": "The inputs one behind the other.",
    "INSERT": "IN1 with IN2 behind its character at position P.",
    "DELETE": "IN without L characters from position P on.",
    "REPLACE": "IN1 with IN2 in place of L characters from position P on.",
    "FIND": "The position at which IN2 begins in IN1 for the first time; 0 if it is not there.",
    "TRUNC": "IN without its fraction, cut toward zero.",
    "TIME": "The time since power-on, as the scan began.",
    "LTIME": "The time since power-on, as the scan began.",
    "IS_VALID": "TRUE if IN is a number: neither infinite nor the result of an undefined operation.",
    "IS_VALID_BCD": "TRUE if each four bits of IN are a decimal digit.",
    "TO_BIG_ENDIAN": "IN with its most significant byte first.",
    "TO_LITTLE_ENDIAN": "IN with its least significant byte first.",
    "FROM_BIG_ENDIAN": "The value of IN, whose most significant byte comes first.",
    "FROM_LITTLE_ENDIAN": "The value of IN, whose least significant byte comes first.",
    "ADD": "The sum of the inputs.",
    "SUB": "IN1 minus IN2.",
    "MUL": "The product of the inputs.",
    "DIV": "IN1 divided by IN2; of integers the quotient, cut toward zero.",
    "MOD": "What the integer division of IN1 by IN2 leaves; it has the sign of IN1.",
    "EXPT": "IN1 to the power of IN2.",
    "AND": "The bits that are set in all inputs.",
    "OR": "The bits that are set in one input at least.",
    "XOR": "The bits that are set in an odd number of inputs.",
    "NOT": "The bits that are not set in IN.",
}
"""What a function returns, after IEC 61131-3 ed. 3, tables 22 to 38."""
_FORMS = {
    "TO": "converts a value to {target}; between integers the low bits stay, any other value that {target} cannot hold stops "
          "the program (R0105).",
    "TRUNC": "converts a value to {target} and cuts its fraction off, toward zero.",
    "TO_BCD": "converts an integer to {target}, four bits a decimal digit.",
    "BCD_TO": "converts a bit string of decimal digits, four bits each, to {target}.",
}
_OPERANDS = {"EXPT": ("ANY_REAL", "ANY_NUM"), "MOD": ("ANY_INT", "ANY_INT"), "AND": ("ANY_BIT",) * 2, "OR": ("ANY_BIT",) * 2,
             "XOR": ("ANY_BIT",) * 2, "NOT": ("ANY_BIT",)}  # fmt: skip
"""The types that operators take, where that is not ANY_NUM; ADD, SUB, MUL and DIV take times and dates, too (table 35)."""


def page(name: str) -> str | None:
    """The page of the standard function of that name in any case; None if there is none."""
    name = fold(name.strip())
    if name in MEANINGS and name in SIGNATURES:
        return _of_signature(name, SIGNATURES[name])
    if name in OPERATORS:
        return _of_operator(name)
    if name in TIME_OPERATORS:
        function, types = TIME_OPERATORS[name]
        pins = [("IN1", types[0]), ("IN2", types[1])]
        return _page(name, MEANINGS[function], pins, "", [f"{function} with types in its name."])
    if (found := conversion(name)) is not None:
        return _of_conversion(name, found)
    if (typed := typed_name(name)) is not None:
        function, kind = typed
        return f"# {name}\n\n{function} of values of type {kind.name}: `fbvm explain {function}`.\n\nStandard function"
    return None


def _of_signature(name: str, signature: Signature) -> str:
    notes = []
    if signature.limits:
        notes.append(f"T is one type for all of them: {', '.join(signature.limits)}.")
    if signature.repeats:
        notes.append("The last input may be there several times, numbered on.")
    if name in OTHER_NAMES:
        notes.append(f"CODESYS calls its inputs {', '.join(OTHER_NAMES[name])}; both names are taken.")
    return _page(name, MEANINGS[name], signature.parameters, signature.result, notes)


def _of_operator(name: str) -> str:
    kinds = _OPERANDS.get(name, ("ANY_NUM", "ANY_NUM"))
    pins = [("IN" if len(kinds) == 1 else f"IN{at}", kind) for at, kind in enumerate(kinds, 1)]
    notes = [f"The function for the operator {OPERATORS[name]}."] if OPERATORS[name] != name else []
    if name in EXTENSIBLE_OPERATORS:
        notes.append("There may be more inputs, numbered on.")
    return _page(name, MEANINGS[name], pins, kinds[0], notes)


def _of_conversion(name: str, found: Conversion) -> str:
    source = found.source or "the type of the argument"
    said = f"Conversion from {source}: it {_FORMS[found.form].format(target=found.target)}"
    return _page(name, said, [("IN", found.source or "ANY_ELEMENTARY")], found.target, [])


def _page(name: str, said: str, pins: list[tuple[str, str]] | tuple[tuple[str, str], ...], result: str, notes: list[str]) -> str:
    head = f"FUNCTION {name}" + (f" : {result}" if result else "")
    rows = ["VAR_INPUT", *(f"    {pin} : {kind};" for pin, kind in pins), "END_VAR"] if pins else []
    return "\n".join([f"# {name}", "", said, "", "```st", head, *rows, "```", "", *(f"{note}\n" for note in notes),
                      "Standard function (IEC 61131-3)"])  # fmt: skip
