"""The three client libraries, each on a PLC of its own in virtual time, told to read three registers time after time.

    rig = ClientRig("mbp_mstr", engine="native")
    assert rig.read() == "ok"
"""

from __future__ import annotations

from dataclasses import dataclass

from server_rig import image_of

from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.net.peers import ModbusPeer, Station
from fbvm.units.contract import Unit
from fbvm.units.etn21.unit import Etn21
from fbvm.units.port.noc import Noc
from fbvm.wire.link import Peer
from fbvm.wire.modbus_server import ModbusServer

SERVER = Peer("192.168.250.2", 502)
SECOND_NS = 1_000_000_000
UNTOUCHED = [0xEEEE, 0xEEEE, 0xEEEE]
LONGEST_S = 25
"""So many seconds a command may take: its Reply_Time, after at most 150 receives that drop what came before it."""
FIRST = 1000
"""The address of the first register on the wire."""


@dataclass(frozen=True)
class Kind:
    """A program that reads registers when `Command` becomes TRUE: what tells that it may, that it has ended, the error code,
    and where the data are."""

    program: str
    ready: str
    ended: str
    code: str
    data: str


KINDS = {
    "mtcp_etn": Kind(
        """PROGRAM Main
        VAR conn : MTCP_ETN_Connect; rd : MTCP_ETN_Fn03 := (Reply_Time := T#700ms); Command : BOOL;
            Values AT D200 : ARRAY[0..2] OF WORD; END_VAR
        conn(IP_Address1 := 192, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := 2, Connect := TRUE);
        rd(EN := conn.ENO, Register_Address := 1000, Register_Qty := 3, RespData_DM := 200, Cmd_Read := Command);
        END_PROGRAM""",
        "Main.conn.ENO", "Main.rd.Exchange.State = 0", "Main.rd.Error_Code", "Main.Values"),
    "etn_modbus": Kind(
        """PROGRAM Main
        VAR Client : ETN_Modbus_Client := (Reply_Time := T#700ms); Command : BOOL; i : INT;
            Request : ARRAY[0..252] OF BYTE := [3, 3, 16#E8, 0, 3]; Values : ARRAY[0..2] OF WORD; END_VAR
        Client(IP_Address1 := 192, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := 2, Command := Command,
               PDU := Request, PDU_Size := 5);
        IF Client.Done AND Command THEN
            FOR i := 0 TO 2 DO
                Values[i] := SHL(BYTE_TO_WORD(Client.Reply[2 + 2 * i]), 8) OR BYTE_TO_WORD(Client.Reply[3 + 2 * i]);
            END_FOR;
        END_IF;
        END_PROGRAM""",
        "Main.Client.Connected", "Main.Client.Done OR Main.Client.Error", "Main.Client.Error_Code", "Main.Values"),
    "mbp_mstr": Kind(
        """PROGRAM Main
        VAR mstr : MBP_MSTR := (Reply_Time := T#700ms, Open_Time := T#3s, Edge := TRUE, Hold := TRUE); Command : BOOL;
            CONTROL : ARRAY[1..9] OF INT := [2, 0, 3, 1001, 16#0700, 192, 168, 250, 2];
            Values : ARRAY[1..3] OF WORD; END_VAR
        mstr(ENABLE := Command, ABORT := FALSE, CONTROL := CONTROL, DATABUF := Values);
        END_PROGRAM""",
        "TRUE", "Main.mstr.SUCCESS OR Main.mstr.ERROR", "Main.CONTROL[2]", "Main.Values"),
}  # fmt: skip


def unit_of(kind: str, timing: str, seed: int) -> Unit:
    return Noc(7, "192.168.250.1") if kind == "mbp_mstr" else Etn21(0, "192.168.250.1", timing=timing, seed=seed)


class ClientRig:
    """A PLC with this client, whose server is at 192.168.250.2 port 502 of a network in memory."""

    def __init__(self, kind: str, *, engine: str = "auto", timing: str = "exact", seed: int = 0) -> None:
        self.kind = KINDS[kind]
        self.peer = ModbusPeer(ModbusServer())
        self.server = self.peer.server
        self.network = LoopNetwork(seed)
        self.network.place(SERVER, self.peer)
        self.plc = Plc(image_of(self.kind.program), 10_000_000, engine=engine)
        self.plc.attach(unit_of(kind, timing, seed), self.network)
        self.round = 0

    def scan(self, count: int = 1) -> None:
        for _ in range(count):
            trap = self.plc.scan()
            assert trap is None, trap

    def place(self, station: Station) -> None:
        """Another server at the endpoint, from the next connection on."""
        self.network.place(SERVER, station)

    def becomes(self, condition: str, max_s: float) -> bool:
        """Scans until the condition holds; False if it does not within so many seconds."""
        if condition == "TRUE":
            return True
        return self.plc.run(until=condition, max_ns=self.plc.now_ns + int(max_s * SECOND_NS)) == "until"

    def read(self, wait_s: float = 3) -> str:
        """One command, for which the server has new values: "ok", its error code, or "-" where no connection comes within
        `wait_s`.  Fails if the data are anything but those values, or if there are any beside an error."""
        self.round += 1
        held = [0x1000 + self.round, self.round, 0xFFFF - self.round]
        self.server.holding_registers[FIRST : FIRST + 3] = type(self.server.holding_registers)("H", held)
        self.plc.write(self.kind.data, UNTOUCHED)
        if not self.becomes(self.kind.ready, wait_s):
            return "-"
        self.plc.write("Main.Command", True)
        self.scan()
        assert self.becomes(self.kind.ended, LONGEST_S), "it is stuck"
        self.scan()
        code, data = self.plc.read(self.kind.code), self.plc.read(self.kind.data)
        self.plc.write("Main.Command", False)
        self.scan()
        assert isinstance(code, int)
        assert data == (UNTOUCHED if code else held), (code, data)
        return f"{code & 0xFFFF:04X}" if code else "ok"
