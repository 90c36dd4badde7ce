"""ANY parameters: the members by which a block reads the argument, whatever type it has.

    x.pValue        a pointer to its first byte (POINTER TO BYTE)
    x.diSize        how many bytes it fills (DINT)              x.BITS[i]    BOOL number i: an element of an array of BOOL,
    x.TypeClass     its type, TYPE_CLASS.TYPE_INT ...                        else bit i, the lowest of the first byte first
    x.BYTES[i]      byte i, likewise WORDS, DWORDS, LWORDS      SIZEOF(x)    as diSize (UDINT)

All begin at 0; UPPER_BOUND(x.BITS, 1) is the last.  A BOOL on a bit of a word fills no byte: it has BITS only.  pValue,
diSize and TypeClass are as in CODESYS; the rest is ours.
"""

from __future__ import annotations

from fbvm.base.types import (
    ANY_CLASS,
    ANY_SIZE,
    BOOL,
    BYTE,
    DWORD,
    LWORD,
    WORD,
    ArrayType,
    Elementary,
    EnumType,
    OpenArrayType,
    RefType,
    StringType,
    StructType,
    SubrangeType,
    Type,
    fold,
    open_array,
)
from fbvm.syntax import tree

VIEWS = {name: open_array(1, kind) for name, kind in (
    ("BITS", BOOL), ("BYTES", BYTE), ("WORDS", WORD), ("DWORDS", DWORD), ("LWORDS", LWORD))}
"""The members that are arrays over what was passed."""
POINTER = "PVALUE"
NUMBERS = {"DISIZE": ANY_SIZE, "TYPECLASS": ANY_CLASS}
"""The members that are numbers, by their place in the slot."""
MEMBERS = frozenset((*VIEWS, *NUMBERS, POINTER))
"""All members of an ANY, folded."""
_CLASSES = {"DATE_AND_TIME": "DATEANDTIME", "TIME_OF_DAY": "TIMEOFDAY", "LDATE_AND_TIME": "LDATEANDTIME",
            "LTIME_OF_DAY": "LTIMEOFDAY"}
_DERIVED: dict[type[Type], str] = {ArrayType: "ARRAY", OpenArrayType: "ARRAY", EnumType: "ENUM", SubrangeType: "SUBRANGE",
                                   RefType: "POINTER", StructType: "USERDEF"}


def type_class(kind: Type) -> str:
    """The member of TYPE_CLASS for a type."""
    if isinstance(kind, StringType):
        return "TYPE_WSTRING" if kind.wide else "TYPE_STRING"
    if isinstance(kind, Elementary):
        return f"TYPE_{_CLASSES.get(kind.name, kind.name)}"
    return f"TYPE_{_DERIVED[type(kind)]}"


def is_array(expr: tree.Member) -> bool:
    """True for a member of an ANY that can be passed on as an array: of bytes or words, not of bits."""
    return fold(expr.name.text) in VIEWS.keys() - {"BITS"}
