"""Charges to the step budget in machine code, and the question whether a run may go on (see `fbvm.engine.allowance`).

`@ask` is called so rarely that it keeps all registers itself (`preserve_mostcc`): else each body would save some at its
beginning, for calls that hardly ever take place."""

from __future__ import annotations

from fbvm.base.areas import BUDGET
from fbvm.engine.native.emit.context import FIELDS
from fbvm.engine.native.emit.writer import Writer

NOT_NEGATIVE = ", !range !7"
"""The metadata of a number of steps that have to be left.  By it LLVM knows that the steps which are left are no point at which
the body has ended, and leaves out the look behind the call of a body that it inlines."""
ASK = f"""
define internal preserve_mostcc i64 @ask(ptr %c, i64 %left) #7 {{
entry:
%ask_at = getelementptr inbounds i8, ptr %c, i64 {FIELDS["ask"]}
%function = load ptr, ptr %ask_at
%nobody = icmp eq ptr %function, null
br i1 %nobody, label %end, label %asked
end:
ret i64 {(1 << 63) - 1}
asked:
%answer = call i64 %function(i64 %left) #8
%least = call i64 @llvm.smax.i64(i64 %answer, i64 0)
%least_at = getelementptr inbounds i8, ptr %c, i64 {FIELDS["least"]}
store i64 %least, ptr %least_at
ret i64 %least
}}
attributes #7 = {{ nounwind noinline cold willreturn memory(argmem: readwrite, inaccessiblemem: readwrite) }}
attributes #8 = {{ nounwind willreturn memory(inaccessiblemem: readwrite) }}
"""


def charge(w: Writer, count: int, site: int) -> None:
    """Takes steps from the budget.  With fewer left than the allowance says, the run ends if nobody gives it more."""
    left = w.new(f"sub i64 {w.new('load i64, ptr %budget')}, {count}")
    w.emit(f"store i64 {left}, ptr %budget")
    w.put_system(BUDGET, left)
    asking, going = w.label("x"), w.label()
    least = w.new(f"load i64, ptr {w.field('least')}{NOT_NEGATIVE}")
    w.unlikely(w.new(f"icmp slt i64 {left}, {least}"), asking, going)
    with w.aside(asking):
        least, ending = w.new(f"call preserve_mostcc i64 @ask(ptr %c, i64 {left}) #7{NOT_NEGATIVE}"), w.label("x")
        w.emit(f"br i1 {w.new(f'icmp slt i64 {left}, {least}')}, label %{ending}, label %{going}")
        w.emit(f"{ending}:")
        w.end("R0104", site)
    w.begin(going)
