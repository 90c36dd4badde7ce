"""Bounds checks of references: the extents of an image's objects as a constant, and the function that compares with them."""

from __future__ import annotations

from fbvm.code.image import Objects
from fbvm.code.operations import FIRST_OBJECT, LEASE_BYTES, LEASED

_INSIDE = """\
; Whether `count` bytes at `offset` lie in the object of that number, which is not the buffer.
define internal fastcc i1 @inside(ptr %m, i64 %number, i64 %offset, i64 %count) #5 {{
entry:
%row = sub i64 %number, {first}
%known = icmp ult i64 %row, {rows}
br i1 %known, label %extent, label %other
extent:
%at = getelementptr [2 x i32], ptr @extents, i64 %row
br label %within
other:
%leased = sub i64 %number, {leased}
%lease = lshr i64 %leased, {held_bits}
%given = icmp ult i64 %lease, {leases}
br i1 %given, label %held, label %no
held:
%place = mul i64 %lease, {lease_bytes}
%here = add i64 %place, {leases_at}
%start = getelementptr i8, ptr %m, i64 %here
%holder_at = getelementptr i8, ptr %start, i64 8
%holder = load i32, ptr %holder_at, align 4
%wide = zext i32 %holder to i64
%mine = and i64 %leased, {held_mask}
%same = icmp eq i64 %wide, %mine
%some = icmp ne i64 %mine, 0
%holds = and i1 %same, %some
br i1 %holds, label %within, label %no
within:
%limits = phi ptr [ %at, %extent ], [ %start, %held ]
%low32 = load i32, ptr %limits, align 4
%end_at = getelementptr i8, ptr %limits, i64 4
%end32 = load i32, ptr %end_at, align 4
%low = zext i32 %low32 to i64
%end = zext i32 %end32 to i64
%last = sub i64 %end, %count
%fits = icmp ule i64 %count, %end
%behind = icmp uge i64 %offset, %low
%before = icmp ule i64 %offset, %last
%both = and i1 %behind, %before
%all = and i1 %both, %fits
ret i1 %all
no:
ret i1 false
}}"""


def objects(table: Objects) -> str:
    """The definitions of `@extents` and `@inside`, which the code of an image with these objects calls."""
    rows = ", ".join(f"[2 x i32] [i32 {start}, i32 {end}]" for start, end in table.extents)
    count = len(table.extents)
    extents = f"@extents = internal constant [{count} x [2 x i32]] {f'[{rows}]' if rows else 'zeroinitializer'}"
    inside = _INSIDE.format(
        first=FIRST_OBJECT, rows=count, leased=LEASED, leases=table.leases, leases_at=table.leases_at,
        held_bits=table.held_bits, held_mask=(1 << table.held_bits) - 1, lease_bytes=LEASE_BYTES)
    return f"{extents}\n{inside}"
