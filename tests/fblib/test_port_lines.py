"""What blocks see of a line of a mailbox port: single bytes, the frame at the front, what is left when bytes are taken away."""

from __future__ import annotations

from functools import cache
from random import Random
from struct import pack, unpack

from rows import each_of

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc

INCOMING_BYTES = 504
LINE = """PROGRAM Main
VAR line : PORT_Line; count, number, client, server, bytes : UINT; b : BYTE; END_VAR
b := PORT_Byte(Line := line, Number := number);
client := PORT_Whole(Line := line, Reply := TRUE); server := PORT_Whole(Line := line, Reply := FALSE);
PORT_Drop(Line := line, Count := count);
bytes := UDINT_TO_UINT(SIZEOF(line));
END_PROGRAM
"""


@cache
def image() -> Image:
    made = compile_text(LINE)
    assert made.image is not None, [message.render() for message in made.diagnostics]
    return made.image


def after_scan(data: bytes, **inputs: int) -> Plc:
    """A PLC whose line has received `data`, after one scan."""
    plc = Plc(image())
    plc.write("Main.line.Incoming", list(unpack(">252H", data.ljust(INCOMING_BYTES, b"\0"))))
    plc.write("Main.line.Received", len(data))
    for name, value in inputs.items():
        plc.write(f"Main.{name}", value)
    assert plc.scan() is None
    return plc


def test_a_line_has_400_words() -> None:
    assert after_scan(b"").read("Main.bytes") == 800


@each_of("number", [0, 1, 2, 3, 7, 12, 255, 256, 502, 503])
def test_each_byte_is_found_by_its_number(number: int) -> None:
    data = Random(1).randbytes(INCOMING_BYTES)
    assert after_scan(data, number=number).read("Main.b") == data[number]


@each_of("count", [0, 1, 2, 3, 11, 12, 253, 254, 501, 502, 503, 504])
@each_of("received", [504, 503, 12, 11])
def test_bytes_that_are_taken_away_leave_the_others_at_the_front(count: int, received: int) -> None:
    data = Random(received).randbytes(received)
    plc = after_scan(data, count=min(count, received))
    left = data[count:]
    assert plc.read("Main.line.Received") == len(left)
    assert pack(">252H", *plc.read("Main.line.Incoming"))[: len(left)] == left


WHOLE, PART, WRONG = 1, 0, 0xFFFF


@each_of(("received", "length", "protocol", "server", "client"), [
    (0, 0, 0, PART, PART), (5, 0, 1, PART, PART), (6, 0, 0, WRONG, WRONG), (6, 1, 0, WRONG, WRONG), (6, 2, 0, PART, PART),
    (7, 2, 0, PART, PART), (8, 2, 0, WHOLE, WHOLE), (9, 2, 0, WHOLE, WHOLE), (9, 1, 0, WRONG, WRONG), (11, 6, 0, PART, PART),
    (12, 6, 0, WHOLE, WHOLE), (24, 6, 0, WHOLE, WHOLE), (259, 254, 0, PART, PART), (260, 254, 0, WHOLE, WHOLE),
    (261, 254, 0, WHOLE, WHOLE), (6, 254, 0, PART, PART), (6, 255, 0, WRONG, WRONG), (261, 255, 0, WRONG, WRONG),
    (504, 0xFFFF, 0, WRONG, WRONG), (12, 6, 1, WHOLE, WRONG), (12, 6, 0xFFFF, WHOLE, WRONG), (11, 6, 1, PART, WRONG),
    (6, 255, 1, WRONG, WRONG),
])  # fmt: skip
def test_a_frame_is_whole_when_its_length_has_come(received: int, length: int, protocol: int, server: int, client: int) -> None:
    """The length is that behind it, of 2 to 254 bytes; a client takes no other protocol than 0."""
    plc = after_scan(pack(">3H", 7, protocol, length).ljust(received, b"\1")[:received])
    expected = [6 + length if found == WHOLE else found for found in (server, client)]
    assert [plc.read("Main.server"), plc.read("Main.client")] == expected
