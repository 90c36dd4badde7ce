"""The code that gives memory of the heap out and takes it back, for __NEW and __DELETE; it is made without a tree.

The heap is a row of blocks, each a head of 8 bytes (its size in units of 8 bytes, the number of its lease from 1 on, 0 if it is
free) and what __NEW makes.  A size of 0 means that everything from there on was never given out.  `taking` takes the first block
that is large enough; free ones beside each other become one on the way.  What is made is the object of a lease, so that a
pointer which is kept longer traps.

All POUs share these bodies, so they charge no steps, since a trap could not say at which statement: the word `steps` has what the
caller is to charge."""

from __future__ import annotations

from fbvm.base.dialects import STANDARD
from fbvm.base.memory import WHOLE_BYTES
from fbvm.code.builder.emitter import Emitter
from fbvm.code.image import Objects
from fbvm.code.operations import HEAP, LEASE_BYTES, LEASED, OBJECT_SHIFT, OFFSET_MASK, OFFSET_SHIFT, Address, Block, Node

UNIT, HEAD_UNITS = 8, 1
"""Bytes to whose multiple a block is rounded up; units in front of what is made."""
ROWS = 16_000
"""Most variables that are made at the same time."""
_START, _END, _HELD, _COUNT = 0, 4, 8, 12
"""Offsets in the row of a lease (`operations.LEASE_BYTES`)."""
_RETURN: Block = (("return",),)
_EXIT: Block = (("exit",),)


def word(objects: Objects, name: str) -> Address:
    """Where a word of the heap lies (see operations.HEAP)."""
    return "abs", objects.heap_at + HEAP[name], ()


def _u32(value: int) -> Node:
    return ("const", "u32", value)


def _u64(value: int) -> Node:
    return ("const", "u64", value)


def _wide(value: Node) -> Node:
    return ("convert", "u64", "u32", value)


def _if(condition: Node, *block: Node, otherwise: Block = ()) -> Node:
    return ("if", ((condition, block),), otherwise)


class _Code(Emitter):
    """A body that works on the heap of a program."""

    def __init__(self, objects: Objects, site: int) -> None:
        super().__init__(STANDARD)
        self.objects, self.site = objects, site

    def variable(self, value: Node) -> Node:
        """A temporary that is assigned again."""
        return self.to_temporary(value, always=True)

    def load(self, name: str) -> Node:
        return ("load", "u32", word(self.objects, name))

    def store(self, name: str, value: Node) -> Node:
        return ("store", "u32", word(self.objects, name), value)

    def more(self, steps: int) -> Node:
        """The statement that adds to the steps."""
        return self.store("steps", _add(self.load("steps"), _u32(steps)))

    def head(self, at: Node, offset: int) -> Address:
        """A word of the head of the block at so many units: 0 for its size, 4 for its lease."""
        return "abs", offset, ((UNIT, ("convert", "i64", "u32", at)),)

    def row(self, row: Node, offset: int) -> Address:
        first = self.objects.leases_at + self.objects.heap_row * LEASE_BYTES
        return "abs", first + offset, ((LEASE_BYTES, ("convert", "i64", "u32", row)),)

    def units(self, size: Node) -> Node:
        return ("div", "u32", size, _u32(UNIT), self.site)


def _let(variable: Node, value: Node) -> Node:
    return ("let", variable[2], "u32", value)


def _add(a: Node, b: Node) -> Node:
    return ("add", "u32", a, b)


def _is(comparison: str, a: Node, b: Node) -> Node:
    return (comparison, "b", "u32", a, b)


# --- giving out -------------------------------------------------------------------------------------------------------


def taking(objects: Objects, site: int) -> Block:
    """The code that makes `reference` one to as many bytes as are `wanted`, NULL without room for them; it sets no values."""
    code = _Code(objects, site)
    code.emit(code.store("steps", _u32(8)), ("store", "ref", word(objects, "reference"), ("const", "ref", 0)))
    wanted = code.to_temporary(code.units(_add(code.load("wanted"), _u32(UNIT * HEAD_UNITS + UNIT - 1))))
    free, used = code.to_temporary(code.load("free")), code.to_temporary(code.load("used"))
    is_used_again = _is("ne", free, _u32(0))
    row = code.to_temporary(("select", "u32", is_used_again, used, ("sub", "u32", free, _u32(1))))
    code.emit(_if(_is("ge", row, _u32(objects.heap_rows)), *_RETURN))
    at = code.variable(code.units(code.load("start")))
    _find(code, wanted, at)
    code.emit(("store", "u32", code.head(at, 0), wanted), ("store", "u32", code.head(at, 4), _add(row, _u32(1))),
              _if(is_used_again, code.store("free", ("load", "u32", code.row(row, _START))),
                  otherwise=(code.store("used", _add(row, _u32(1))),)))
    most = (1 << objects.held_bits) - 1
    held = code.to_temporary(_add(("mod", "u32", ("load", "u32", code.row(row, _COUNT)), _u32(most), site), _u32(1)))
    start = code.to_temporary(("mul", "u32", _add(at, _u32(HEAD_UNITS)), _u32(UNIT)))
    code.emit(("store", "u32", code.row(row, _COUNT), held), ("store", "u32", code.row(row, _HELD), held),
              ("store", "u32", code.row(row, _START), start),
              ("store", "u32", code.row(row, _END), _add(start, code.load("wanted"))),
              ("store", "ref", word(objects, "reference"), _reference(objects, row, held, start)))
    return tuple(code.out)


def _reference(objects: Objects, row: Node, held: Node, start: Node) -> Node:
    """A reference to the first byte of what a lease with that number holds."""
    first = LEASED + (objects.heap_row << objects.held_bits)
    number = ("add", "u64", ("add", "u64", ("mul", "u64", _wide(row), _u64(1 << objects.held_bits)), _wide(held)), _u64(first))
    position = ("add", "u64", ("mul", "u64", _wide(start), _u64(1 << OFFSET_SHIFT)), _u64(WHOLE_BYTES))
    return ("bits", "ref", "u64", ("or", "u64", ("mul", "u64", number, _u64(1 << OBJECT_SHIFT)), position))


def _find(code: _Code, wanted: Node, at: Node) -> None:
    """Emit the search for a block: `at` is the unit at which it begins then.  Without room the body returns."""
    end = code.to_temporary(code.units(code.load("end")))
    size = code.variable(_u32(0))
    room, behind = ("sub", "u32", end, at), _add(at, wanted)
    with code.block() as body:
        code.emit(_if(_is("ge", at, end), *_RETURN), _let(size, ("load", "u32", code.head(at, 0))),
                  _if(_is("eq", size, _u32(0)), _if(_is("lt", room, wanted), *_RETURN),
                      _if(_is("gt", room, wanted), ("store", "u32", code.head(behind, 0), _u32(0))), *_EXIT))
        with code.block() as free:
            _join(code, at, size, end)
            rest = ("sub", "u32", size, wanted)
            code.emit(_if(_is("eq", size, _u32(0)), ("next",)),
                      _if(_is("ge", size, wanted),
                          _if(_is("gt", size, wanted), ("store", "u32", code.head(behind, 0), rest),
                              ("store", "u32", code.head(behind, 4), _u32(0))), *_EXIT))
        code.emit(_if(_is("eq", ("load", "u32", code.head(at, 4)), _u32(0)), *free))
    code.emit(("loop", (code.more(2),), tuple(body), (_let(at, _add(at, size)),)))


def _join(code: _Code, at: Node, size: Node, end: Node) -> None:
    """Emit that a free block takes in the free ones behind it; `size` is 0 if everything behind it is free."""
    with code.block() as body:
        following = code.to_temporary(_add(at, size))
        code.emit(_if(_is("ge", following, end), *_EXIT))
        its = code.to_temporary(("load", "u32", code.head(following, 0)))
        code.emit(_if(_is("eq", its, _u32(0)), ("store", "u32", code.head(at, 0), _u32(0)), _let(size, _u32(0)), *_EXIT),
                  _if(_is("ne", ("load", "u32", code.head(following, 4)), _u32(0)), *_EXIT),
                  _let(size, _add(size, its)), ("store", "u32", code.head(at, 0), size))
    code.emit(("loop", (code.more(1),), tuple(body), ()))


# --- taking back ------------------------------------------------------------------------------------------------------


def looking(objects: Objects, site: int) -> Block:
    """The code that finds out whether `reference` can be ended: `verdict` says so, and `row` which lease it has."""
    code = _Code(objects, site)
    code.emit(code.store("verdict", _u32(1)))
    bits = code.to_temporary(("bits", "u64", "ref", ("load", "ref", word(objects, "reference"))))
    first = _u64(LEASED + (objects.heap_row << objects.held_bits))
    number = code.to_temporary(("div", "u64", bits, _u64(1 << OBJECT_SHIFT), site))
    code.emit(_if(("lt", "b", "u64", number, first), *_RETURN))
    number = code.to_temporary(("sub", "u64", number, first))
    row = code.to_temporary(("convert", "u32", "u64", ("div", "u64", number, _u64(1 << objects.held_bits), site)))
    code.emit(_if(_is("ge", row, code.load("used")), *_RETURN))
    held = ("convert", "u32", "u64", ("mod", "u64", number, _u64(1 << objects.held_bits), site))
    code.emit(_if(_is("ne", held, ("load", "u32", code.row(row, _HELD))), code.store("verdict", _u32(2)), *_RETURN))
    offset = ("convert", "u32", "u64", ("and", "u64", ("div", "u64", bits, _u64(1 << OFFSET_SHIFT), site), _u64(OFFSET_MASK)))
    code.emit(_if(_is("eq", offset, ("load", "u32", code.row(row, _START))), code.store("verdict", _u32(0)),
                  code.store("row", row)))
    return tuple(code.out)


def giving(objects: Objects, site: int) -> Block:
    """The code that ends what the lease `row` holds: every pointer to it traps from now on."""
    code = _Code(objects, site)
    row = code.to_temporary(code.load("row"))
    at = ("sub", "u32", code.units(("load", "u32", code.row(row, _START))), _u32(HEAD_UNITS))
    code.emit(("store", "u32", code.head(code.to_temporary(at), 4), _u32(0)), ("store", "u32", code.row(row, _HELD), _u32(0)),
              ("store", "u32", code.row(row, _START), code.load("free")), code.store("free", _add(row, _u32(1))))
    return tuple(code.out)
