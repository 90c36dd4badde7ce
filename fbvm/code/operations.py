"""The table of operations: every meaning that code can have.  A back end decides nothing.

Code is plain data: nested tuples whose first item names the operation.  *Expressions* are `(name, type, *operands)` and
have no effect but a trap; *statements* are `(name, *operands)`.  `type` is a machine type:

    b            BOOL, 0 or 1 (a byte <> 0 is 1)  f32 f64   REAL, LREAL (a computed NaN is canonical)
    i8 .. i64    signed, two's complement         s8  s16   STRING, WSTRING: characters without the ending 0
    u8 .. u64    unsigned, bit strings            ref       a reference (64 bits: object << 40 | offset << 8 | bit)

*Addresses* say where a value lies in the flat buffer: `(base, offset, terms)`, offset a constant number of bytes and terms
a tuple of `(stride, expression i64)` to be added.  `base` is

    "abs"                          offset counts from the start of the buffer
    "self"                         from the start of the instance that is executed
    ("ref", expression, site)      from where a reference points (R0110 if it is null or its object has ended, or if
                                   not all bytes of the access lie in the object; found when the terms are evaluated)

A reference's offset is one of the buffer, its bit 0 to 7 for a located BOOL and 255 for a value that fills bytes.  Its
object (Image.objects) says how far the reference may be moved: 0 is null, 1 the whole buffer, from 2 on a row of the
extents each; those from LEASED on are leases, for what may end while pointers to it are kept.  `site` is the number of a
place in the source (Image.sites), for traps.
Operands are evaluated from left to right, an address where it stands.  `let` temporaries belong to one execution of one
body.  `math`, `pow` and `atan2` of f32 are worked out in 64 bits and rounded once.
An `attempt` executes a part of its body, for the same instance.  It gives 0 if that has come to its end, else the number in
CAUGHT of the code with which it has stopped: that of a way out (WAYS_OUT), or, if `traps` is True, that of a trap.  What it does
not catch stops its own body as well.
Meaning: IEC 61131-3 ed. 3 with the decisions on edges that are stated beside each row.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from fbvm.base.arithmetic import limits as limits
from fbvm.base.memory import BIT_MASK as BIT_MASK
from fbvm.base.memory import BUFFER_OBJECT as BUFFER_OBJECT
from fbvm.base.memory import OBJECT_SHIFT as OBJECT_SHIFT
from fbvm.base.memory import OFFSET_MASK as OFFSET_MASK
from fbvm.base.memory import OFFSET_SHIFT as OFFSET_SHIFT
from fbvm.base.memory import WHOLE_BYTES as WHOLE_BYTES

Node = tuple[Any, ...]
"""An operation with its operands."""
Address = tuple[Any, int, tuple[tuple[int, Node], ...]]
Block = tuple[Node, ...]

INTEGERS = ("i8", "i16", "i32", "i64", "u8", "u16", "u32", "u64")
FLOATS = ("f32", "f64")
TEXT_UNITS = {"s8": 1, "s16": 2}
"""Bytes of a character of each form of text; constants are `bytes`, and for s16 a `str` of UTF-16 units."""
FIRST_OBJECT, LEASED = 2, 1 << 23
"""Numbers of objects behind that of the whole buffer: the first row of the extents, the first lease."""
LEASE_BYTES = 16
"""A lease in the buffer: offset of the first byte and of the first behind, the number under which it is held now (0:
it has ended), how often it was given; 32 bits each."""
HEAP = {"reference": 0, "wanted": 8, "verdict": 12, "used": 16, "free": 20, "start": 24, "end": 28, "row": 32,
        "steps": 36}
"""Offsets of the words that __NEW and __DELETE work with: the reference that is made or ended (ref), and 32 bits each the bytes
that are wanted, what is found of a reference (0: it can be ended, see `HEAP_TRAPS`), how many leases were ever given, the first
of those that were given back (counted from 1, 0: none), where the heap begins and ends, the row that was found, how many
steps the work was worth."""
HEAP_BYTES = 40
HEAP_TRAPS = {1: "R0123", 2: "R0124"}
"""What can be wrong with a reference that __DELETE is given, and the trap of each."""
SIZES = {"b": 1, "i8": 1, "u8": 1, "i16": 2, "u16": 2, "i32": 4, "u32": 4, "i64": 8, "u64": 8, "f32": 4, "f64": 8,
         "ref": 8}


@dataclass(frozen=True)
class Operation:
    """A row: name, operands in words, what it yields ("" for statements), traps, meaning."""

    name: str
    operands: str
    result: str
    traps: tuple[str, ...]
    meaning: str


_EXPRESSIONS = """
const      | value                  | any    |             | the value itself
tmp        | number                 | any    |             | the temporary of that number
load       | address                | no text|             | the value at a naturally aligned place
load_raw   | address                | no text|             | the same at any place
load_bit   | address bit            | b      |             | bit 0..7 of the byte at the place
load_flag  | address                | b      | R0110       | a BOOL behind a reference: its byte, or the bit it names
load_text  | address capacity       | text   |             | the characters up to the first 0, at most capacity
add        | a b                    | number |             | sum; integers wrap; f32 is rounded to 32 bits
sub        | a b                    | number |             | difference; likewise
mul        | a b                    | number |             | product; likewise
div        | a b site               | number | R0101       | integers toward zero, min / -1 wraps; floats per IEEE 754, no trap
mod        | a b site               | integer| R0101       | remainder with the sign of a; min mod -1 is 0
neg        | a                      | number |             | minus a, wraps
abs        | a                      | number |             | magnitude; of the smallest integer: itself
pow        | a b                    | float  |             | a to the b; x**0 is 1, 0**negative inf, negative**fraction NaN
and        | a b                    | b, uN  |             | bitwise
or         | a b                    | b, uN  |             | bitwise
xor        | a b                    | b, uN  |             | bitwise
not        | a                      | b, uN  |             | bitwise, in the width
and_then   | a b                    | b      |             | b is evaluated only if a is TRUE
or_else    | a b                    | b      |             | b is evaluated only if a is FALSE
shl        | a n site               | integer| R0106       | n is i64; n >= width gives 0
shr        | a n site               | integer| R0106       | zeros enter, also for signed types
rol        | a n site               | integer| R0106       | n modulo width
ror        | a n site               | integer| R0106       | n modulo width
eq         | type a b               | b      |             | operands of `type`; NaN equals nothing; texts by units
ne         | type a b               | b      |             | not eq
lt         | type a b               | b      |             | less; texts unit by unit, a prefix is less
le         | type a b               | b      |             | less or equal
gt         | type a b               | b      |             | greater
ge         | type a b               | b      |             | greater or equal
convert    | from a                 | number |             | integer to integer: low bits, sign read anew; to float: nearest
nearest    | from a site            | integer| R0105       | float to integer, ties to even; NaN, inf, out of range trap
truncate   | from a site            | integer| R0105       | float to integer toward zero; likewise
bits       | from a                 | any    |             | the same bits read as another type of that width (NaN canonical)
is_set     | from a                 | b      |             | a <> 0 (NaN is)
select     | g a b                  | any    |             | a if g is FALSE, b if TRUE; both are evaluated
mux        | k (a, ...) site        | any    | R0107       | k is i64; all are evaluated
min        | a b                    | not ref|             | the lesser, a if equal; NaN if one is NaN
max        | a b                    | not ref|             | the greater, a if equal; NaN if one is NaN
check      | a low high code site   | integer| code        | a itself; trap `code` (R0102, R0103, R0105) outside low..high
within     | a low high code site   | i64    | code        | a itself; trap `code` outside low..high, all three worked out
math       | function a             | float  |             | sqrt ln log exp sin cos tan asin acos atan; NaN outside the domain
atan2      | y x                    | float  |             | angle; both 0 give 0
floor_div  | a b                    | i64    |             | quotient toward minus infinity, b a positive constant
now        |                        | i64    |             | the scan's time, ns
from_bcd   | from a site            | integer| R0105       | decimal digits in nibbles to a number; a nibble above 9 traps
to_bcd     | from a site            | integer| R0105       | the reverse; more digits than nibbles or a negative number trap
length     | a                      | i16    |             | number of characters of a string
left       | a n site               | text   | R0108       | the first n characters; n is i64, negative traps
right      | a n site               | text   | R0108       | the last n characters
mid        | a n p site             | text   | R0108       | n characters from position p (first is 1; p < 1 traps)
concat     | a b                    | text   |             | a followed by b
insert     | a b p site             | text   | R0108       | b after character p of a; p = 0 in front; p < 0 traps
delete     | a n p site             | text   | R0108       | without n characters from p; p behind the end: unchanged
replace    | a b n p site           | text   | R0108       | n characters from p replaced by b; p behind the end: appended
characters | a                      | i64    |             | number of characters of an s16, surrogate pairs as one
units_of   | a n                    | i64    |             | units of the first n characters of an s16, at most all; of n < 0 n
find       | a b                    | i16    |             | first position of b in a, 0 if none or b is empty
to_text    | data_type a            | s8     |             | the value as a literal would be read back, by data type's name
from_text  | data_type a site       | any    | R0111 R0105 | reads a literal with or without type prefix, spaces trimmed
from_leading | data_type whole a     | any    |             | the literal that a text begins with (if `whole`: that it is), else 0
enum_text  | names a                | s8     |             | the member's name by value from `names`, else the number
character  | a                      | text   |             | the one character of code a (u8 for s8, u16 for s16); none of code 0
first      | a                      | u8, u16|             | the code of the first character of a text; 0 if it is empty
recode     | a                      | text   |             | a text in the other width; to s8 a unit above 255 becomes ?
reference  | address bit            | ref    |             | the place in object 1, or the base's; bit 0..7 or 255 (WHOLE_BYTES)
bit_behind | a n                    | ref    |             | bit n (i64) on from where a points: bit 0 of a byte, or a bit
"""

_STATEMENTS = """
store      | type address a         |        |             | a to a naturally aligned place
store_raw  | type address a         |        |             | the same to any place
store_bit  | address bit a          |        |             | a to bit 0..7 of the byte
store_flag | address a              |        | R0110       | a to a BOOL behind a reference
store_text | address capacity a     |        |             | the characters cut to capacity, then one 0
copy       | to from size           |        |             | size bytes as if all were read before any is written
fill       | address bytes          |        |             | constant bytes (initial values of a frame)
let        | number type a          |        |             | a becomes the temporary
if         | ((c, block), ...) block|        |             | the block of the first c that is TRUE, else the last
case       | type a rows block      |        |             | rows are (((low, high), ...), block); first fit, else the last block
loop       | head body tail         |        |             | head, body, tail, again; `next` in the body goes to the tail
exit       |                        |        |             | leaves the innermost loop
next       |                        |        |             | to the tail of the innermost loop
return     |                        |        |             | leaves the body
call       | pou address            |        |             | executes the body of that number; address of its instance, or None
attempt    | pou address number traps |   |          | call, and what has ended the body becomes the u32 temporary (below)
reverse    | address size runs      |        |             | each item's bytes backwards; runs (offset, count, stride, item)
charge     | count site             |        | R0104       | takes count from the step budget and stores it; below 0 traps
due        | a                      |        |             | notes time a (ns) if it is earlier than what is noted
stop       | code site              |        | code        | traps
raise      | a site                 |        | R0122       | traps with the u32 a, which is above all of WAYS_OUT
observe    | kind site detail       |        |             | statement, rung, contact, read or write; a plain build drops it
count      | number                 |        |             | adds 1 to a counter beside the memory; the compiler makes none
mark       | number rows a          |        |             | a (b or u8) into a byte beside the memory, by rows of instances
"""


def _rows(text: str, kind: str) -> dict[str, Operation]:
    table = {}
    for line in text.strip().splitlines():
        name, operands, result, traps, meaning = (part.strip() for part in line.split("|", 4))
        table[name] = Operation(name, operands, result if kind == "expression" else "", tuple(traps.split()), meaning)
    return table


EXPRESSIONS = _rows(_EXPRESSIONS, "expression")
STATEMENTS = _rows(_STATEMENTS, "statement")

WAYS_OUT = {"return": 1, "exit": 2, "next": 3}
"""Codes of `stop` that are no traps: jumps out of an attempt, to be done by the body around."""
UNKNOWN_EXCEPTION = 0xFFFFFFFF
RAISED = 0xFFFFFFFE
"""In CAUGHT, in place of the number that the trap of a `raise` carries itself."""
CAUGHT = WAYS_OUT | {
    "R0101": 0x102, "R0102": 0x101, "R0103": 0x103, "R0105": 0x103, "R0110": 0x51, "R0121": 0x54,
    "R0122": RAISED,
    **dict.fromkeys(("R0106", "R0107", "R0108", "R0109", "R0111"), UNKNOWN_EXCEPTION)}  # fmt: skip
"""By code what an attempt gives: of traps the member of ExceptionCode (CODESYS Development System, data type
__SYSTEM.ExceptionCode).  The watchdog and a program that stops itself are not caught."""


def caught(code: str, traps: bool) -> int:
    """What an attempt gives that a body has stopped with a code: 0 if it does not catch that, RAISED for what was raised."""
    number = CAUGHT.get(code, 0)
    return number if traps or code in WAYS_OUT else 0


CALLS = ("call", "attempt")
"""Statements that execute a body: its number and the address of its instance are their first operands."""

OBSERVATIONS: dict[str, str] = {
    "statement": "a statement is about to be executed; no detail",
    "rung": "a rung is about to be executed; detail: its number",
    "contact": "a contact was evaluated; detail: (element, expression b)",
    "read": "a variable was read; detail: (type, address, bit); bit 255 for a value that fills bytes",
    "write": "a variable was written; detail: (type, address, bit); observed after the store",
}
"""Kinds of `observe` and what their detail carries.  A text's type is (form, capacity), an aggregate's ("", size)."""


def detail_size(form: str | tuple[str, int]) -> int:
    """Bytes of what the detail of a read or a write tells."""
    if isinstance(form, str):
        return SIZES[form]
    return (form[1] + 1) * TEXT_UNITS[form[0]] if form[0] else form[1]
