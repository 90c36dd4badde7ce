"""Breakpoints in machine code: at each observation one byte of the stop table is looked up (see `fbvm.engine.stops`).

Code with these checks is a build of its own, made for the first breakpoint of a program."""

from __future__ import annotations

from fbvm.engine.native.emit.context import FIELDS
from fbvm.engine.native.emit.writer import STOPPABLE, Writer
from fbvm.engine.stops import ASK, AT_STATEMENT, COUNT, ROW_BYTES, ROWS, STOPPED, TABLE, WATCHING

GUARD = f"""
define internal i64 @guard(ptr %m, ptr %c, i64 %site, i64 %statement) #5 {{
entry:
%at = getelementptr inbounds i8, ptr %c, i64 {FIELDS["stops"]}
%s = load ptr, ptr %at
%table = getelementptr inbounds i8, ptr %s, i64 {TABLE}
%entry_at = getelementptr inbounds i8, ptr %table, i64 %site
%byte = load i8, ptr %entry_at
%bits = zext i8 %byte to i64
%line = and i64 %bits, %statement
%here = icmp ne i64 %line, 0
br i1 %here, label %ask, label %begin
begin:
%count_at = getelementptr inbounds i8, ptr %s, i64 {COUNT}
%count = load i64, ptr %count_at
%rows_at = getelementptr inbounds i8, ptr %s, i64 {ROWS}
%rows = load ptr, ptr %rows_at
br label %test
test:
%n = phi i64 [ 0, %begin ], [ %n1, %row ]
%more = icmp ult i64 %n, %count
br i1 %more, label %row, label %same
row:
%row_offset = mul i64 %n, {ROW_BYTES}
%r = getelementptr inbounds i8, ptr %rows, i64 %row_offset
%offset = load i64, ptr %r
%mask_at = getelementptr inbounds i8, ptr %r, i64 8
%mask = load i64, ptr %mask_at
%last_at = getelementptr inbounds i8, ptr %r, i64 16
%last = load i64, ptr %last_at
%place = getelementptr inbounds i8, ptr %m, i64 %offset
%now = load i64, ptr %place, align 1
%differing = xor i64 %now, %last
%counting = and i64 %differing, %mask
%n1 = add i64 %n, 1
%changed = icmp ne i64 %counting, 0
br i1 %changed, label %ask, label %test
same:
ret i64 0
ask:
%doubled = shl i64 %site, 1
%what = or i64 %doubled, %statement
%ask_at = getelementptr inbounds i8, ptr %s, i64 {ASK}
%function = load ptr, ptr %ask_at
%answer = call i64 %function(ptr %m, i64 %what) #6
ret i64 %answer
}}
attributes #5 = {{ nounwind noinline cold willreturn memory(read, inaccessiblemem: readwrite) }}
attributes #6 = {{ nounwind willreturn memory(read, inaccessiblemem: readwrite) }}
"""
assert AT_STATEMENT == 1, "a statement is told from a write by this bit"


def observe(w: Writer, kind: str, site: int) -> None:
    """Writes the check at an observation: the run ends here if the table says so."""
    if kind not in STOPPABLE:
        return
    statement = kind != "write"
    stops = w.new(f"load ptr, ptr {w.field('stops')}, !invariant.load !1")
    armed = w.new(f"load i8, ptr {w.new(f'getelementptr inbounds i8, ptr {stops}, i64 {TABLE + site}')}")
    if not statement:
        armed = w.new(f"and i8 {armed}, {WATCHING}")
    asking, going = w.label("x"), w.label()
    w.unlikely(w.new(f"icmp ne i8 {armed}, 0"), asking, going)
    with w.aside(asking):
        answer = w.new(f"call i64 @guard(ptr %m, ptr %c, i64 {site}, i64 {int(statement)}) #5")
        ending = w.label("x")
        w.emit(f"br i1 {w.new(f'icmp ne i64 {answer}, 0')}, label %{ending}, label %{going}")
        w.emit(f"{ending}:")
        w.end(STOPPED, site)
    w.begin(going)


def at_end(number: int, sites: int, point: int) -> list[str]:
    """The lines behind program number `number` of a task: watched bytes are compared once more; `point` is that of a stop."""
    return [f"%s{number} = call i64 @guard(ptr %m, ptr %c, i64 {sites}, i64 0) #5", f"%n{number} = icmp ne i64 %s{number}, 0",
            f"br i1 %n{number}, label %y{number}, label %h{number}", f"y{number}:", f"ret i32 {point}", f"h{number}:"]
