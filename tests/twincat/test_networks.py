"""Ladder and FBD in TwinCAT's files: what they become, what comes of it in a scan, and what is refused."""

from __future__ import annotations

import pytest
from archives import END, LEADS, NOTHING, assign, box, drawn, leaf, network, operand, parallel, pou, wire
from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.code.compiler import compile_sources
from fbvm.engine.native.engine import available
from fbvm.interchange.twincat.objects import read_object
from fbvm.machine.plc import Plc

NEGATED, SET, RESET, JUMP, RETURN, RISING, FALLING = 1, 2, 3, 4, 8, 16, 32
HEAD = ("PROGRAM Main\nVAR\na, b, c, p, q, r : BOOL; n, m, k : INT; t : TON; e : T_Block; f : T_Block; pt : TIME := T#40ms;\n"
        "END_VAR\n")
ENGINES = ("python", "native") if available() else ("python",)


def logic(kind: str, *inputs: str, bits: tuple[int, ...] = ()) -> str:
    return box(kind, inputs, kind.title(), input_bits=bits)


def timer(given: str, *targets: str, bits: int = 0) -> str:
    return box("TON", [given, leaf("pt", "TIME")], "FunctionBlock", instance="t", names=("IN PT", "BOOL TIME"), bits=bits,
               outs=("Q ET", "BOOL TIME"), targets=targets or (LEADS, operand("", "TIME")))


def block(given: str, *more: str, name: str = "e", targets: tuple[str, ...] = (LEADS, NOTHING)) -> str:
    """A block with EN and ENO, and an in-out."""
    return box("T_Block", [given, *more], "FunctionBlock", instance=name, enabled=True,
               names=("EN x v", "BOOL INT INT[REF]"), outs=("ENO y", "BOOL INT"), targets=targets)


def function(kind: str, *inputs: str, target: str) -> str:
    """A function with EN and ENO."""
    return box(kind, inputs, kind.title(), names=("EN", "BOOL"), outs=("ENO -", "BOOL -"), targets=(LEADS, target), enabled=True)


def made(view: str, *networks: str, head: str = HEAD) -> tuple[list[str], list[str]]:
    """The lines behind the declaration, each with one blank between words, and the messages."""
    found = read_object(pou(head, drawn(view, *networks)).encode(), "Main.TcPOU")
    assert found.source is not None
    lines = [" ".join(line.split()) for line in found.source.text.splitlines() if line.strip()]
    return lines[lines.index("END_VAR") + 1:-1], [one.message for one in found.diagnostics]


FORMS = {
    "contacts in series": ("Ld", [network(assign(logic("AND", leaf("a"), leaf("b", bits=NEGATED)), operand("p")))],
                           ["LADDER", "RUNG 1", "LD a", "AND NOT b", "OUT p", "END_LADDER"]),
    "contacts in parallel, and coils": (
        "Ld", [network(assign(logic("AND", logic("OR", leaf("a"), leaf("b")), leaf("c")), operand("p"),
                              operand("q", bits=SET), operand("r", bits=RESET)), comment="both ways")],
        ["LADDER", "RUNG 1 both ways", "LD a", "OR b", "AND c", "OUT p", "SET q", "RSET r", "END_LADDER"]),
    "a branch": ("Ld", [network(assign(parallel(leaf("b"), leaf("c"), feed=leaf("a")), operand("p")))],
                 ["LADDER", "RUNG 1", "LD a", "LD b", "OR c", "AND LD", "OUT p", "END_LADDER"]),
    "a branch that is a wire": ("Ld", [network(assign(parallel(leaf("b"), END, feed=leaf("a")), operand("p")))],
                                ["// network 1", "p := a AND b OR a;"]),
    "a coil at the rail": ("Ld", [network(assign(END, operand("p")))], ["// network 1", "p := TRUE;"]),
    "operators": ("Fbd", [network(assign(logic("AND", leaf("a"), leaf("b"), bits=(0, NEGATED)), operand("p"),
                                         operand("q", bits=NEGATED)))],
                  ["VAR_TEMP Power_10000000003 : BOOL; END_VAR", "// network 1", "Power_10000000003 := a AND NOT b;",
                   "p := Power_10000000003;", "q := NOT Power_10000000003;"]),
    "an assignment on the way": ("Fbd", [network(assign(timer(assign(leaf("a"), operand("p"))), operand("q")))],
                                 ["// network 1", "p := a;", "t(IN := a, PT := pt);", "q := t.Q;"]),
    "outputs of a box": ("Ld", [network(timer(leaf("a"), operand("p"), operand("pt", "TIME")))],
                         ["// network 1", "t(IN := a, PT := pt);", "p := t.Q;", "pt := t.ET;"]),
    "a wire that branches": (
        "Ld", [network(wire(1, logic("AND", leaf("a"), leaf("b"))), assign(logic("AND", wire(1), leaf("c")), operand("p")),
                       assign(wire(1), operand("q")))],
        ["LADDER", "RUNG 1", "LD a", "AND b", "OUT TR0", "AND c", "OUT p", "LD TR0", "OUT q", "END_LADDER"]),
    "a value behind power": (
        "Ld", [network(wire(1, leaf("a")), assign(logic("AND", leaf("b"), wire(1)), operand("p")))],
        ["// network 1", "p := b AND a;"]),
    "an assignment behind power": (
        "Ld", [network(assign(logic("AND", leaf("a"), leaf("n > 1", "")), operand("p")))],
        ["// network 1", "p := a AND (n > 1);"]),
    "a function with EN": ("Ld", [network(function("ADD", leaf("a"), leaf("n", "INT"), leaf("1", "INT"),
                                                   target=operand("n", "INT")))],
                           ["// network 1", "IF a THEN n := n + 1; END_IF;"]),
    "jump, label and return": (
        "Ld", [network(assign(leaf("a"), operand("on", bits=JUMP))), network(assign(END, operand("???", "", RETURN))),
               network(assign(leaf("b"), operand("p")), label="on")],
        ["// network 1", "IF a THEN JMP on; END_IF;", "// network 2", "RETURN;", "// network 3", "on:", "LADDER", "RUNG 1",
         "LD b", "OUT p", "END_LADDER"]),
    "what is commented out": ("Ld", [network(assign(leaf("none"), operand("p")), commented_out=True, comment="not now")], []),
    "a call of an action": ("Ld", [network(box("Act", [], "Action", outs=("", ""), targets=()))], ["// network 1", "Act();"]),
    "a method": ("Fbd", [network(box("f.Reset", [leaf("n", "INT")], "Method", names=("to", "INT"), outs=("Reset", "BOOL"),
                                     targets=(operand("p"),)))],
                 ["// network 1", "p := f.Reset(to := n);"]),
    "a negated box": ("Fbd", [network(assign(box("OR", [leaf("a"), leaf("b")], "Or", bits=NEGATED), operand("p")))],
                      ["// network 1", "p := NOT (a OR b);"]),
    "a negated box in ladder": ("Ld", [network(assign(box("AND", [leaf("a"), leaf("b")], "And", bits=NEGATED), operand("p")))],
                                ["// network 1", "p := NOT (a AND b);"]),
    "the output of a block that is negated leads on": (
        "Fbd", [network(assign(timer(leaf("a"), LEADS, operand("pt", "TIME"), bits=NEGATED), operand("p")))],
        ["// network 1", "t(IN := a, PT := pt);", "pt := t.ET;", "p := NOT t.Q;"]),
    "of outputs of which none leads on the first is negated": (
        "Fbd", [network(timer(leaf("a"), operand("p"), operand("pt", "TIME"), bits=NEGATED))],
        ["// network 1", "t(IN := a, PT := pt);", "p := NOT t.Q;", "pt := t.ET;"]),
    "the second output leads on": ("Fbd", [network(assign(timer(leaf("a"), operand("p"), LEADS), operand("pt", "TIME")))],
                                   ["// network 1", "t(IN := a, PT := pt);", "p := t.Q;", "pt := t.ET;"]),
    "a function whose output is not listed": (
        "Fbd", [network(assign(box("ABS", [leaf("n", "INT")], "Abs", outs=("", ""), targets=()), operand("m", "INT")))],
        ["// network 1", "m := ABS(n);"]),
    "a block in a row of contacts": ("Ld", [network(assign(logic("AND", leaf("a"), timer(leaf("b")), leaf("c")), operand("p")))],
                                     ["// network 1", "t(IN := b, PT := pt);", "p := a AND t.Q AND c;"]),
    "a coil in a row of contacts": (
        "Ld", [network(assign(logic("AND", leaf("a"), assign(leaf("b"), operand("p")), leaf("c")), operand("q")))],
        ["LADDER", "RUNG 1", "LD a", "AND b", "OUT p", "AND c", "OUT q", "END_LADDER"]),
    "inputs of a block without a value": (
        "Fbd", [network(timer(leaf(""), operand("p"), NOTHING).replace(leaf("pt", "TIME"), NOTHING))],
        ["// network 1", "t();", "p := t.Q;"]),
    "words as bits": ("Ld", [network(assign(box("AND", [leaf("n", "INT"), leaf("m", "INT")], "And"), operand("k", "INT")))],
                      ["// network 1", "k := n AND m;"]),
    "contacts of a box that is no series": ("Ld", [network(assign(logic("XOR", leaf("a"), leaf("b")), operand("p")))],
                                            ["// network 1", "p := a XOR b;"]),
    "contacts of a box with EN": (
        "Ld", [network(box("OR", [leaf("a"), leaf("b"), leaf("c")], "Or", names=("EN", "BOOL"), outs=("ENO -", "BOOL -"),
                           targets=(NOTHING, operand("p")), enabled=True))],
        ["VAR_TEMP Enabled_10000000005 : BOOL; END_VAR VAR Result_10000000005 : BOOL; END_VAR", "// network 1",
         "Enabled_10000000005 := a;", "IF Enabled_10000000005 THEN Result_10000000005 := b OR c; END_IF;",
         "IF Enabled_10000000005 THEN p := Result_10000000005; END_IF;"]),
    "inputs without names": (
        "Fbd", [network(box("SUB", [leaf("n", "INT"), leaf("m", "INT")], "Sub", targets=(operand("k", "INT"),)))],
        ["// network 1", "k := n - m;"]),
    "the size of a variable": ("Fbd", [network(assign(box("SIZEOF", [leaf("n", "INT")], "Sizeof"), operand("k", "INT")))],
                               ["// network 1", "k := SIZEOF(IN := n);"]),
    "the address of a variable": ("Fbd", [network(assign(box("Adr", [leaf("n", "INT")], "Adr"), operand("k", "INT")))],
                                  ["// network 1", "k := Adr(IN := n);"]),
    "a title and a comment": (
        "Ld", [network(assign(leaf("a"), operand("p", bits=FALLING)), comment="two").replace(
            '<n n="Label"', '<v n="Title">" one "</v><n n="Label"')],
        ["LADDER", "RUNG 1 one", "'two", "LD a", "DIFD p", "END_LADDER"]),
    "negated jump and return": (
        "Ld", [network(assign(leaf("a"), operand("on", bits=JUMP | NEGATED))),
               network(assign(leaf("b"), operand("", bits=RETURN | NEGATED))), network(label=" on ")],
        ["// network 1", "IF NOT a THEN JMP on; END_IF;", "// network 2", "IF NOT b THEN RETURN; END_IF;", "// network 3",
         "on:"]),
    "a jump in FBD": ("Fbd", [network(assign(END, operand("on", bits=JUMP))), network(assign(END, operand("", bits=RETURN))),
                              network(label="on")],
                      ["// network 1", "JMP on;", "// network 2", "RETURN;", "// network 3", "on:"]),
    "a network as deep as one may be": ("Ld", [network("<o n='Input' t='BoxTreeTerminator'>" * 150 + "</o>" * 150)], []),
}  # fmt: skip


@pytest.mark.parametrize("name", FORMS)
def test_what_a_drawing_becomes(name: str) -> None:
    view, networks, lines = FORMS[name]
    assert made(view, *networks) == (lines, [])


REFUSED = {
    "an operand is missing": assign(leaf("???"), operand("p")),
    "the box TON has no instance": box("TON", [], "FunctionBlock", instance="???"),
    "nothing is assigned": "<o t='BoxTreeAssign'></o>",
    "nobody knows what BoxTreeMux does": "<o t='BoxTreeMux'></o>",
    "nobody knows what a box Strange of the kind wonder does": box("Strange", [], "Wonder"),
    "the wire 3 begins nowhere": assign(wire(3), operand("p")),
    "a box stands in a branch in parallel": assign(parallel(leaf("a"), timer(leaf("b"))), operand("p")),
    "p has flags that only outputs have": assign(leaf("p", bits=SET), operand("q")),
    "the box AND has flags that are not known": assign(box("AND", [leaf("a"), leaf("b")], "And", bits=SET), operand("q")),
    "an input has flags that are not known": assign(logic("AND", leaf("a"), leaf("b"), bits=(0, SET)), operand("q")),
    "what the box LE gives while its EN is FALSE is not known: it has no ENO": assign(
        box("LE", [leaf("a"), leaf("n", "INT"), leaf("1", "INT")], "Le", names=("EN", "BOOL"), enabled=True), operand("q")),
    "the first input of the box TON is not its EN": box("TON", [leaf("a")], "FunctionBlock", instance="t", enabled=True,
                                                        names=("IN", "BOOL")),
    "the box T has no output that could be taken": assign(box("T", [], "FunctionBlock", instance="t", outs=("", ""), targets=()),
                                                          operand("p")),
    "an output of the box T has no name": box("T", [], "FunctionBlock", instance="t", outs=("", ""), targets=(operand("p"),)),
    "a box has Structured Text in it": box("EXECUTE", [], "Execute").replace('Snippet">false', 'Snippet">true'),
    "the network is deeper than 150": "<o n='Input' t='BoxTreeTerminator'>" * 151 + "</o>" * 151,
}  # fmt: skip


NOTHING_READ = {
    "nothing is assigned": network(assign(END, operand("p"))),
    "an operand is missing": network(assign(leaf("a"), operand("???"))),
    "the network is an instruction list": network().replace('<l2 n="ILLines" />', '<l2 n="ILLines"><o /></l2>'),
    "the box TON has no instance": network(box("TON", [], "FunctionBlock")),
}  # fmt: skip


@each_of("why", NOTHING_READ)
def test_what_is_not_understood_in_fbd_is_refused(why: str) -> None:
    assert made("Fbd", NOTHING_READ[why]) == ([], [f"a network of Main is not read: {why}"])


def test_a_branch_without_a_value_is_a_wire_past_the_others() -> None:
    lines, said = made("Ld", network(assign(logic("OR", leaf("a"), END), operand("p"))))
    assert (lines, said) == (["// network 1", "p := TRUE;"], ["nothing comes of a: it reaches no output"])


@pytest.mark.parametrize("why", REFUSED)
def test_what_is_not_understood_is_refused_and_the_rest_is_there(why: str) -> None:
    lines, said = made("Ld", network(REFUSED[why]), network(assign(leaf("a"), operand("p"))))
    assert said == [f"a network of Main is not read: {why}"]
    assert lines == ["LADDER", "RUNG 1", "LD a", "OUT p", "END_LADDER"]


def test_each_network_stands_on_the_line_where_it_begins_in_the_file() -> None:
    text = pou(HEAD, drawn("Fbd", network(assign(leaf("a"), operand("p"))), network(timer(leaf("b")))))
    found = read_object(text.encode(), "Main.TcPOU").source
    assert found is not None
    lines, given = found.text.splitlines(), text.splitlines()
    begins = [at for at, line in enumerate(given) if line == "<o>" and given[at + 1].startswith('<n n="Comment"')]
    assert [lines[at + 1].strip() for at in begins] == ["// network 1", "// network 2"]
    assert len(lines) == len(given)
    one = read_object(text.replace(">\n<", "><").encode(), "Main.TcPOU").source
    assert one is not None
    assert [line.strip() for line in one.text.splitlines() if line.strip()][-5:] == [
        "// network 1", "p := a;", "// network 2", "t(IN := b, PT := pt);", "END_PROGRAM"]  # fmt: skip


BLOCK = """FUNCTION_BLOCK T_Block
VAR_INPUT x : INT; END_VAR VAR_OUTPUT y : INT; END_VAR VAR_IN_OUT v : INT; END_VAR
y := 2 * x; v := v + 1;
END_FUNCTION_BLOCK"""


@pytest.mark.slow
def test_what_drawings_do_scan_by_scan() -> None:
    networks = [
        network(assign(leaf("a", bits=RISING), operand("p", bits=SET))),
        network(assign(logic("AND", leaf("p"), leaf("a", bits=FALLING)), operand("q"))),
        network(assign(block(leaf("a"), leaf("n", "INT"), leaf("k", "INT"), targets=(LEADS, operand("m", "INT"))), operand("r"))),
        network(function("ADD", leaf("a"), leaf("n", "INT"), leaf("5", "INT"), target=operand("n", "INT"))),
        network(assign(leaf("b"), operand("over", bits=JUMP))),
        network(assign(timer(leaf("a")), operand("c"))),
        network(label="over"),
    ]
    found = read_object(pou(HEAD, drawn("Ld", *networks)).encode(), "Main.TcPOU")
    assert found.source is not None and not found.diagnostics
    compiled = compile_sources([found.source, Source("T_Block.st", BLOCK)], runnable=True, dialect="twincat")
    assert compiled.image is not None, compiled.errors
    seen = []
    for engine in ENGINES:
        plc = Plc(compiled.image, 20_000_000, engine=engine)
        rows = []
        for a, b in ((0, 0), (1, 0), (1, 0), (1, 0), (0, 1), (0, 0)):
            plc.write("Main.a", bool(a))
            plc.write("Main.b", bool(b))
            assert plc.scan() is None
            rows.append("".join(str(int(plc.read(f"Main.{name}"))) for name in "pqrc")
                        + " " + " ".join(str(plc.read(f"Main.{name}")) for name in "nmk"))
        seen.append(rows)
    assert seen == [["0000 0 0 0", "1010 5 0 1", "1010 10 10 2", "1011 15 20 3", "1101 15 20 3", "1000 15 20 3"]] * len(ENGINES)
