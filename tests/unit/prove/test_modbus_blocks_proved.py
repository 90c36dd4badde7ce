"""Proofs of the MTCP_ETN blocks, in whose words the unit may write anything at any time.

They hold for a unit that keeps to its sheet all the more.  The parameters of requests are those of a program that gives them
once; its commands come at any time."""

from __future__ import annotations

import pytest
from depth import times

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.prove.prover import Limits, Prover, prove
from fbvm.prove.question import NEVER, NO_TRAP, REACH, Question, Verdict

pytestmark = pytest.mark.slow
UNIT_WORDS = ("CIO1509", "CIO1519", "D30001", "D30009", "D30018..D30027", "D32510..D32642")
"""Status and switches of socket 1, its words of D memory, and where a reply is received."""
READS = ("Fn01", "Coil"), ("Fn02", "Coil"), ("Fn03", "Register"), ("Fn04", "Register")
WRITES = ("Fn0F", "Coil"), ("Fn10", "Register")
SINGLE = ("Fn05", "Coil", "TRUE"), ("Fn06", "Register", "4711")

CALLS = {
    **{name: f"{what}_Address := 1000, {what}_Qty := 3, RespData_DM := 200, Cmd_Read := Command" for name, what in READS},
    **{name: f"{what}_Address := 1000, {what}_Qty := 3, DataAddress_DM := 300, Cmd_Write := Command" for name, what in WRITES},
    **{name: f"{what}_Address := 1000, Value := {value}, Cmd_Write := Command" for name, what, value in SINGLE},
}
LIMITS = Limits(scans=4, simulated_scans=20)


def client(*names: str) -> Image:
    """A program with a connection and a block for each name, commanded as the environment likes."""
    blocks = "".join(f"    {name}_ : MTCP_ETN_{name};\n" for name in names)
    calls = "".join(f"    {name}_(EN := conn.ENO, {CALLS[name]});\n" for name in names)
    text = ("PROGRAM Main\nVAR_INPUT Connect, Command : BOOL; END_VAR\nVAR\n    conn : MTCP_ETN_Connect;\n"
            f"{blocks}END_VAR\n    conn(IP_Address1 := 192, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := 2, "
            f"Connect := Connect);\n{calls}END_PROGRAM\n")  # fmt: skip
    image = compile_text(text, lint=False).image
    assert image is not None
    return image


def asked(image: Image, text: str = "") -> Verdict:
    return prove(image, Question(NEVER if text else NO_TRAP, text, free=UNIT_WORDS), LIMITS)


@pytest.mark.parametrize("name", CALLS)
def test_no_trap_whatever_the_unit_says(name: str) -> None:
    assert asked(client(name)).word == "proved"


@pytest.mark.parametrize("name", ["Fn03", "Fn05", "Fn10"])
def test_error_and_success_are_never_told_together(name: str) -> None:
    verdict = asked(client(name), f"Main.{name}_.Error <> (Main.{name}_.Error_Code <> 0)")
    assert (verdict.word, verdict.notes) == ("proved", ())


def test_a_connection_is_never_up_and_in_error() -> None:
    assert asked(client(), "Main.conn.ENO AND Main.conn.Error").word == "proved"
    assert asked(client(), "Main.conn.ENO AND Main.conn.Waiting_Server").word == "proved"


def test_a_block_never_sends_and_receives_at_once_if_the_unit_keeps_its_rules() -> None:
    both = "CIO1519.03 AND CIO1519.04"  # W421 6-9-4 p156 forbids it
    image = client("Fn03")
    kept = prove(image, Question(NEVER, both, free=("D32510..D32642",), units=((0, 1),)), LIMITS)
    assert (kept.word, kept.notes) == ("proved", ("assumed: what the manuals say of socket 1 of ETN21 0",))
    assert asked(image, both).word == "broken"
    connected = prove(image, Question(REACH, "Main.conn.ENO", units=((0, 1),)), LIMITS)
    assert connected.word == "reached"


def test_a_run_that_is_shown_keeps_the_rules() -> None:
    image = client()
    assert prove(image, Question(NEVER, "D30027 = 5", units=((0, 1),)), LIMITS).word == "proved"  # which is no code
    verdict = prove(image, Question(NEVER, "D30027 = 74", units=((0, 1),)), LIMITS)
    assert verdict.run is not None
    assert (verdict.word, verdict.run.scans) == ("broken", 2)  # the first scan asks for it
    assert asked(image, "D30027 = 74").run.scans == 1  # type: ignore[union-attr]


READER, WRITER, LINE = "Main.Fn03_.Exchange", "Main.Fn05_.Exchange", "MTCP_ETN_Line"
TURNS = {1: "Main.conn.Turn", 2: f"{READER}.Turn", 3: f"{WRITER}.Turn"}
BOTH = f"{READER}.State > 1 AND {WRITER}.State > 1"
NO_WRAP = f"{LINE}.Scan < 4000000000"
"""Scans are counted in 32 bits: at 10 ms for 463 days."""
LEMMAS = (
    "Main.conn.Turn.Id = 1",
    f"{READER}.Turn.Id = 0 AND {WRITER}.Turn.Id = 0 AND {LINE}.Ids = 1 AND {READER}.State = 0 AND {WRITER}.State = 0 "
    f"OR {READER}.Turn.Id = 2 AND {WRITER}.Turn.Id = 3 AND {LINE}.Ids = 3",
    *(f"{READER}.Turn.{name} = {WRITER}.Turn.{name}" for name in ("Seen", "Patience", "Interval")),
    f"{READER}.Turn.Seen <= {LINE}.Scan",
    *(f"{LINE}.Queue[{at}].Id <> {id} OR {LINE}.Queue[{at}].Seen = {turn}.Seen AND {LINE}.Queue[{at}].Patience = {turn}.Patience"
      for id, turn in TURNS.items() for at in (0, 1)),
    *(f"{block}.State <= 1 OR {LINE}.Queue[0].Id = {id} OR {LINE}.Scan - {block}.Turn.Seen > {block}.Turn.Patience"
      for id, block in ((2, READER), (3, WRITER))),
)
"""Both blocks have EN from the connection, so they are away at the same scans: the queue knows of each what it knows itself, and
one that uses the socket is at its head, or was away for too long and gives up when it comes back."""


def test_two_blocks_that_use_the_socket_at_once_are_not_found() -> None:
    prover = Prover(client("Fn03", "Fn05"), Question(NEVER, BOTH, free=UNIT_WORDS), LIMITS, print)
    assert prover.search.until(6) is None
    assert prover.search.cleared == 6


@pytest.mark.skipif(times(1) == 1, reason="takes a minute of processor time: with --deep")
def test_one_block_at_most_uses_the_socket_whatever_the_unit_says() -> None:
    question = Question(NEVER, BOTH, (NO_WRAP,), UNIT_WORDS, lemmas=LEMMAS)
    verdict = prove(client("Fn03", "Fn05"), question, LIMITS)
    assert (verdict.word, verdict.notes) == ("proved", (f"assumed: {NO_WRAP}",))
