"""The ETN21 inside machine code of whole scans, beside the same PLC on the Python engine: memory equal after each scan."""

from __future__ import annotations

from collections.abc import Iterable

import pytest

from fbvm import Etn21, LoopNetwork, Peer, Plc, compile_text
from fbvm.code.image import Image
from fbvm.engine.native import engine as native
from fbvm.machine.fast.units_in_code import WithUnits
from fbvm.net.peers import Actions, Conversation, Say, Station

SERVER = Peer("192.168.250.7", 7)
ECHO = """
PROGRAM Main                    // sends more and more bytes and receives what comes back, again and again
VAR
    Status AT CIO 1509 : WORD; Datagrams AT CIO 1501 : WORD; Switches AT CIO 1519 : WORD; Waiting AT D30001 : UINT;
    P AT D30018 : ARRAY[0..9] OF WORD; Out AT D1000 : ARRAY[0..499] OF WORD;
    Size : UINT := 1; State, i : INT; Exchanges : UDINT;
END_VAR
VAR CONSTANT OPEN : UINT := {open}; END_VAR
    CASE State OF
        0:
            FOR i := 0 TO 499 DO Out[i] := INT_TO_WORD(257 * i + 3); END_FOR;
            P[0] := 1; P[1] := 3000; P[2] := 16#C0A8; P[3] := 16#FA07; P[4] := 7;
            Switches := SHL(WORD#1, OPEN); State := 1;
        1:
            IF Switches = 0 THEN State := 2; END_IF;
        2:
            P[5] := UINT_TO_WORD(Size); P[6] := 16#8203; P[7] := 16#E800; Switches := 16#0008; State := 3;
        3:
            IF Switches = 0 THEN State := 4; END_IF;
        4:
            IF Waiting >= Size OR OPEN = 0 THEN
                P[6] := {area}; P[7] := UINT_TO_WORD(16#6400 + 256 * (Size MOD 7));
                Switches := 16#0010; State := 5;
            END_IF;
        5:
            IF Switches = 0 THEN
                Exchanges := Exchanges + 1; Size := Size + 37; State := 2;
                IF Size > 990 THEN Size := Size - 987; END_IF;
            END_IF;
    END_CASE;
END_PROGRAM
"""


class _Echo(Conversation):
    def received(self, data: bytes, now_ns: int) -> Actions:
        return [Say(data)]


class Echo(Station):
    """Says what it hears."""

    def accept(self, caller: Peer) -> Conversation:
        return _Echo()

    def datagram(self, data: bytes, caller: Peer) -> Iterable[bytes]:
        return [data]


def plc_with(image: Image, engine: str, odd_filler: int | None) -> Plc:
    plc, network = Plc(image, engine=engine), LoopNetwork()
    network.place(SERVER, Echo())
    plc.attach(Etn21(0, "192.168.250.21", odd_filler=odd_filler), network)
    return plc


@pytest.mark.slow
@pytest.mark.skipif(not native.available(), reason="llvmlite is not installed")
@pytest.mark.parametrize("odd_filler", [0, 0xFF, None])
@pytest.mark.parametrize(("switch", "area"), [(2, "16#8200"), (0, "16#8200"), (2, "16#B100")])
def test_received_bytes_are_where_they_belong(switch: int, area: str, odd_filler: int | None) -> None:
    """Odd and even sizes, several rounds of a ring, TCP and UDP, areas D and W."""
    image = compile_text(ECHO.format(open=switch, area=area)).image
    assert image
    inside, python = (plc_with(image, engine, odd_filler) for engine in ("native", "python"))
    for scan in range(1200):
        assert inside.scan() is None
        assert python.scan() is None
        if scan % 10 == 0:
            assert bytes(inside.memory.words("D")) == bytes(python.memory.words("D"))
            assert bytes(inside.memory.words("W")) == bytes(python.memory.words("W"))
    assert isinstance(inside.fast_path(), WithUnits)
    assert inside.read("Main.Exchanges") == python.read("Main.Exchanges")
    assert int(str(inside.read("Main.Exchanges"))) > 150
    assert bytes(inside.memory.words("CIO")) == bytes(python.memory.words("CIO"))
