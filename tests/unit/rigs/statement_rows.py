"""Statements of code with what they leave in memory, as rows of a table."""

from __future__ import annotations

from typing import Any

from hand_image import at, behind, const, load, own, store

from fbvm.base.areas import SLOTS_OFFSET
from fbvm.code.operations import Block, Node


def reference(offset: int, bit: int = 255) -> Node:
    return const("ref", 1 << 40 | SLOTS_OFFSET + offset << 8 | bit)




def add(offset: int, value: Node) -> Node:
    """slot := slot + value"""
    return store("i16", offset, ("add", "i16", load("i16", offset), value))




def is_(value: Node, number: int) -> Node:
    return "eq", "b", "i16", value, const("i16", number)




def when(condition: Node, *then: Node) -> Node:
    return "if", ((condition, then),), ()




def counting(first: int, last: int, *body: Node, tmp: int = 1) -> tuple[Node, ...]:
    """FOR t := first TO last DO body"""
    t = ("tmp", "i16", tmp)
    return (("let", tmp, "i16", const("i16", first)),
            ("loop", (when(("gt", "b", "i16", t, const("i16", last)), ("exit",)),), body,
             (("let", tmp, "i16", ("add", "i16", t, const("i16", 1))),)))


T1 = ("tmp", "i16", 1)
WORDS = b"\1\0\2\0\3\0\4\0"
# name, code, bytes before by slot, bytes of slots 0.. after (or the trap's code)
PROGRAMS: list[tuple[str, Block, dict[int, bytes], Any]] = [
    ("store wraps", (store("i8", 0, ("add", "i8", load("i8", 1), const("i8", 1))),), {1: b"\x7f"}, b"\x80\x7f"),
    ("store with terms", (("store", "i16", at(-2, (2, load("u8", 8))), const("i16", 7)),), {8: b"\3"}, b"\0\0\0\0\7"),
    ("store in the instance", (("store", "u8", own(3), const("u8", 9)), store("u8", 0, ("load", "u8", own(3)))), {},
     b"\x09"),
    ("store_raw", (("store_raw", "i32", at(1), const("i32", -2)),), {}, b"\0\xfe\xff\xff\xff\0"),
    ("store_raw wraps", (("store_raw", "u16", at(1), ("sub", "u16", load("u16", 0), const("u16", 1))),), {},
     b"\0\xff\xff\0"),
    ("store_raw rounds to infinity",
     (("store_raw", "f32", at(1), ("mul", "f32", const("f32", 1e30), const("f32", 1e30))),), {},
     b"\0\0\0\x80\x7f"),
    ("store_bit", (("store_bit", at(0), 3, load("b", 8)), ("store_bit", at(1), 7, ("not", "b", load("b", 8)))),
     {0: b"\x01\xff", 8: b"\1"}, b"\x09\x7f"),
    ("store_bit of constants", (("store_bit", at(0), 0, const("b", 1)), ("store_bit", at(1), 0, const("b", 0))),
     {0: b"\x80\xff"},
     b"\x81\xfe"),
    ("store_bit with terms", (("store_bit", at(0, (1, load("u8", 8))), 1, load("b", 8)),), {8: b"\1"}, b"\0\2"),
    ("store_flag of a byte", (("store_flag", behind(reference(2)), load("b", 8)),), {8: b"\5"}, b"\0\0\1"),
    ("store_flag of a bit",
     (("store_flag", behind(reference(2, 6)), const("b", 1)), ("store_flag", behind(reference(2, 1)), const("b", 0))),
     {2: b"\3"}, b"\0\0\x41"),
    ("store_flag without reference", (("store_flag", at(2), const("b", 1)),), {}, b"\0\0\1"),
    ("store_flag to null", (("store_flag", behind(load("ref", 40)), const("b", 1)),), {}, "R0110"),
    ("store behind a reference at any place", (("store", "i16", behind(reference(1), 2), const("i16", -2)),), {},
     b"\0\0\0\xfe\xff"),
    ("store to null", (("store", "i16", behind(load("ref", 40)), const("i16", 1)),), {}, "R0110"),
    ("store_text", (("store_text", at(0), 3, const("s8", b"abcdef")),), {0: b"\xff" * 5}, b"abc\0\xff"),
    ("store_text shorter", (("store_text", at(0), 3, const("s8", b"a")),), {0: b"\xff" * 3}, b"a\0\xff"),
    ("store_text behind a reference", (("store_text", behind(reference(1)), 3, const("s8", b"a")),), {0: b"\xff" * 3},
     b"\xffa\0"),
    ("copy", (("copy", at(0), at(16), 4),), {16: WORDS}, b"\1\0\2\0\0\0"),
    ("copy upward over itself", (("copy", at(2), at(0), 6),), {0: WORDS}, b"\1\0\1\0\2\0\3\0"),
    ("copy downward over itself", (("copy", at(0, (1, const("i64", 0))), at(2), 6),), {0: WORDS}, b"\2\0\3\0\4\0\4\0"),
    ("copy behind references", (("copy", behind(reference(0)), behind(reference(17)), 2),), {16: WORDS}, b"\0\2"),
    ("copy from null", (("copy", at(0), behind(load("ref", 40)), 2),), {}, "R0110"),
    ("fill", (("fill", at(1), b"\7\x08"),), {}, b"\0\7\x08\0"),
    ("reverse", (("reverse", at(0), 8, ((0, 2, 2, 2), (5, 1, 3, 3))),), {0: b"\1\2\3\4\5\6\7\x08"},
     b"\2\1\4\3\5\x08\7\6"),
    ("reverse with gaps", (("reverse", behind(reference(1)), 7, ((0, 2, 4, 2),)),), {0: b"\0\1\2\3\4\5\6\7"},
     b"\0\2\1\3\4\6\5\7"),
    ("reverse at null", (("reverse", behind(load("ref", 40)), 4, ((0, 1, 4, 4),)),), {}, "R0110"),
    ("let is kept", (("let", 1, "i16", load("i16", 0)), store("i16", 0, const("i16", 5)), store("i16", 2, T1)),
     {0: b"\3"}, b"\5\0\3"),
    ("if takes the first that is true", (("if", ((load("b", 8), (store("u8", 0, const("u8", 1)),)),
                                                 (load("b", 9), (store("u8", 0, const("u8", 2)),)),
                                                 (load("b", 10), (store("u8", 0, const("u8", 3)),))), (store("u8", 0,
                                                  const("u8", 4)),)),),
     {9: b"\1\1"}, b"\2"),
    ("if takes the last block", (("if", ((load("b", 8), ()),), (store("u8", 0, const("u8", 4)),)),), {}, b"\4"),
    ("loop", counting(1, 10, add(0, T1)), {}, b"\x37"),
    ("exit", counting(1, 10, when(is_(T1, 4), ("exit",)), add(0, T1)), {}, b"\6"),
    ("next goes to the tail", counting(1, 10, when(is_(T1, 4), ("next",)), add(0, T1)), {}, b"\x33"),
    ("exit in the tail",
     (("loop", (), (add(0, const("i16", 1)), when(is_(load("i16", 0), 3), ("next",)), add(2, const("i16", 1))),
                           (when(is_(load("i16", 0), 5), ("exit",)),)),), {}, b"\5\0\4"),
    ("exit leaves the innermost loop", counting(1, 3, *counting(1, 9, when(is_(("tmp", "i16", 2), 2), ("exit",)),
                                                               add(0, const("i16", 1)), tmp=2)), {}, b"\3"),
    ("return", (add(0, const("i16", 1)), ("return",), add(0, const("i16", 1))), {}, b"\1"),
    ("return from loops", (*counting(1, 3, *counting(1, 3, add(0, T1), ("return",), tmp=2)), add(0, T1)), {}, b"\1"),
    ("charge", (("charge", 100, 3),) * 5, {}, b"\0"),
    ("charge too much", (store("u8", 0, const("u8", 1)), ("charge", 1001, 3), store("u8", 0, const("u8", 2))), {},
     "R0104"),
    ("stop", (("stop", "R0109", 3),), {}, "R0109"),
    ("raise", (store("u8", 0, const("u8", 1)), ("raise", load("u32", 0), 3)), {}, "R0122"),
    ("mark", (("mark", 1, (), const("b", True)), store("u8", 0, const("u8", 1)), ("mark", 0, (0, 8, 1, 2), const("b", False))),
     {}, b"\1"),
    ("count", (("count", 0), store("u8", 0, const("u8", 1)), ("count", 1)), {}, b"\1"),
    ("empty", (), {}, b"\0"),
    ("address before value",
     (("store", "i16", behind(load("ref", 40)), ("div", "i16", const("i16", 1), load("i16", 0), 3)),), {}, "R0110"),
    ("index before value", (("store", "i16", at(0, (2, ("check", "i64", const("i64", 5), 0, 4, "R0102", 3))),
                             ("div", "i16", const("i16", 1), load("i16", 0), 3)),), {}, "R0102"),
    ("flag's address before value", (("store_flag", behind(load("ref", 40)),
                                      ("is_set", "b", "i16",
                                       ("div", "i16", const("i16", 1), load("i16", 0), 3))),), {}, "R0110"),
]
OBSERVED = (
    ("observe", "statement", 3, None), ("observe", "read", 3, ("i16", own(2, (2, load("i64", 0))), 255)),
    ("store_bit", at(9), 4, const("b", 1)), ("observe", "write", 3, ("b", at(9), 4)),
    ("observe", "rung", 4, 17), ("observe", "contact", 4, ((1, "x"), ("load_bit", "b", at(9), 4))),
    ("observe", "write", 4, ("b", behind(load("ref", 16)), 255)),
    ("observe", "write", 4, (("s8", 20), behind(load("ref", 16), 8), 255)),
)
