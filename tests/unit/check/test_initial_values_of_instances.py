"""Initial values of instances in functions, where a dialect takes variables in them: constants but for the inputs of one."""

from __future__ import annotations

import pytest

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc

TEXT = """\
FUNCTION_BLOCK B
VAR_INPUT i : INT; END_VAR
VAR_OUTPUT k : INT; END_VAR
    k := k + 1;
END_FUNCTION_BLOCK
FUNCTION Sum : DINT
VAR_INPUT m : INT; END_VAR
VAR
    b : B := (k := 3);
    c : B := (i := m);
    many : ARRAY[1..2] OF B := [(k := 1), (k := 2, i := 7)];
END_VAR
    b();
    Sum := b.k + 10 * c.i + 100 * many[1].k + 1000 * many[2].k + 10000 * INT_TO_DINT(many[2].i);
END_FUNCTION
PROGRAM Main
VAR one, two : DINT; END_VAR
    one := Sum(5); two := Sum(6);
END_PROGRAM
"""


@pytest.mark.parametrize("dialect", ["codesys", "rusty"])
def test_instances_of_a_function_begin_anew_at_each_call(dialect: str) -> None:
    found = compile_text(TEXT, dialect=dialect, lint=False)
    assert found.image is not None, [each.message for each in found.diagnostics]
    plc = Plc(found.image)
    plc.scan()
    assert (plc.read("Main.one"), plc.read("Main.two")) == (72154, 72164)
