"""A large text of blocks and a program that calls them, for benchmarks of editors."""

from __future__ import annotations

BLOCK = """
FUNCTION_BLOCK Station_{n}
VAR_INPUT Start : BOOL; Level : INT; END_VAR
VAR_OUTPUT Run : BOOL; Mean : REAL; END_VAR
VAR Wait : TON; History : ARRAY [0..15] OF INT; Place, i, State : INT; Sum : DINT; END_VAR
{body}END_FUNCTION_BLOCK
"""
BODY = """\
    Wait(IN := Start AND State = {k}, PT := T#5s);
    History[Place] := Level;
    Sum := 0;
    FOR i := 0 TO 15 DO
        Sum := Sum + History[i];
    END_FOR;
    CASE State OF
        {k}: IF Wait.Q THEN State := State + 1; END_IF
    ELSE
        Mean := DINT_TO_REAL(Sum) / 16.0;
        Run := Mean > 3.5 OR Wait.Q;
    END_CASE;
    Place := (Place + 1) MOD 16;
"""


def text_of(lines: int) -> str:
    """A text of so many lines, in blocks of 300."""
    body = "".join(BODY.format(k=k) for k in range(22))
    count = max(1, round(lines / (body.count("\n") + 6)))
    main = "\n".join(f"    S{n}(Start := TRUE, Level := {n});" for n in range(count))
    held = "\n".join(f"    S{n} : Station_{n};" for n in range(count))
    blocks = "".join(BLOCK.format(n=n, body=body) for n in range(count))
    return blocks + f"PROGRAM Main\nVAR\n{held}\nEND_VAR\n{main}\nEND_PROGRAM\n"
