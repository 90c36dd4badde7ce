"""Peers that misbehave over real TCP: the same codes as in memory, and no scan that ever waits for one of them."""

from __future__ import annotations

import gc
import io
import itertools
import os
import select
import socket
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from depth import times
from real_station import black_hole, closed_port, real

import fbvm.net.switchboard
import fbvm.net.tcp
import fbvm.net.udp
from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.net.addresses import AddressMap
from fbvm.net.journal import Journal, open_journal
from fbvm.net.misdeeds import MISDEEDS, RUDE_PEERS, by_script, right
from fbvm.net.peers import ModbusPeer
from fbvm.net.tcp import TcpNetwork
from fbvm.record.recording.journal_replay import Replay
from fbvm.run import run
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.link import Peer
from fbvm.wire.modbus_server import ModbusServer

SERVER = Peer("192.168.250.2", 502)
SECOND_NS = 1_000_000_000
PROGRAM = """
PROGRAM Main
VAR
    conn : MTCP_ETN_Connect := (Open_Time := T#300ms, Retry_Time := T#30ms);
    rd : MTCP_ETN_Fn03 := (Reply_Time := T#300ms);
    Cmd, Poll : BOOL;
END_VAR
    conn(IP_Address1 := 192, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := 2, Connect := TRUE);
    IF Poll THEN
        Cmd := NOT Cmd;
    END_IF;
    rd(EN := conn.ENO, Register_Address := 1000, Register_Qty := 3, RespData_DM := 200, Cmd_Read := Cmd);
END_PROGRAM
"""
HELD = [0x1234, 0xFFFF, 0x8001]


def held() -> ModbusServer:
    server = ModbusServer()
    server.holding_registers[1000:1003] = type(server.holding_registers)("H", HELD)
    return server


@cache
def image() -> Image:
    made = compile_text(PROGRAM).image
    assert made is not None
    return made


@contextmanager
def plc_at(port: int, journal: Journal | None = None) -> Iterator[Plc]:
    """A PLC whose server is at a port of 127.0.0.1."""
    plc, network = Plc(image(), 5_000_000, journal=journal), TcpNetwork({SERVER: ("127.0.0.1", port)})
    plc.attach(Etn21(0, "192.168.250.1"), network)
    try:
        yield plc
    finally:
        network.close()


def until(plc: Plc, condition: str, seconds: float = 10) -> None:
    reason = run(plc, until=condition, max_ns=int(seconds * SECOND_NS), pace="event")
    assert reason == "until", (condition, plc.read("Main.conn.Error_Code"), plc.read("Main.rd.Error_Code"))


def read(plc: Plc) -> str:
    """One command: "ok" with the right data, or its code with the destination untouched."""
    plc.memory.words("D")[200:204] = memoryview(bytes(8)).cast("H")
    until(plc, "Main.conn.ENO")
    counter = plc.read("Main.rd.Rcv_Counter")
    plc.write("Main.Cmd", True)
    until(plc, f"Main.rd.Rcv_Counter <> {counter} OR Main.rd.Error")
    plc.write("Main.Cmd", False)
    run(plc, scans=1, pace="event")
    code = plc.read("Main.rd.Error_Code")
    assert plc.read("D200..D203") == ([0] * 4 if code else [*HELD, 0])
    return f"{code:04X}" if code else "ok"


ANSWERS = {
    "two pieces": {"ok"},
    "byte by byte": {"ok"},
    "twice": {"ok"},
    "a wrong one first": {"ok"},
    "flood behind": {"ok"},
    "wrong transaction": {"0080"},
    "server failure": {"0004"},
    "exception FF": {"0080"},
    "wrong protocol": {"0045"},
    "flood": {"0045"},
    "silence": {"0080"},
    "half": {"0080"},
    "half, then fin": {"0081"},
    "fin": {"0081"},
    "reset": {"004B"},
    "one byte, then reset": {"004B"},
}


@pytest.mark.slow
@pytest.mark.parametrize("name", ANSWERS)
def test_a_wrong_answer(name: str) -> None:
    peer = ModbusPeer(held(), by_script(name))
    with real(peer, haste=5) as port, plc_at(port) as plc:
        if "ok" in ANSWERS[name]:
            plc.write("Main.rd.Reply_Time", 5 * SECOND_NS)  # what does come may come late where the computer is busy
        assert read(plc) in ANSWERS[name]
        peer.reply = right
        run(plc, for_ns=100_000_000, pace="event")
        plc.write("Main.rd.Reply_Time", SECOND_NS)
        again = [read(plc) for _ in range(3)]
        assert again[-1] == "ok"
        assert set(again) <= {"ok", "0080", "0081", "0045"}


PLACES: dict[str, Callable[[], AbstractContextManager[int]]] = {
    "black hole": black_hole,
    "closed port": closed_port,
    **{name: (lambda name=name: real(RUDE_PEERS[name](held()))) for name in (
        "closes at once", "resets at once", "closes between requests", "never reads", "resets in mid-request",
        "drips for ever", "floods from the start",
    )},
    "silent": lambda: real(ModbusPeer(held(), MISDEEDS["silence"])),
    "slow": lambda: real(ModbusPeer(held(), MISDEEDS["byte by byte"])),
    "flooding": lambda: real(ModbusPeer(held(), MISDEEDS["flood behind"])),
}


@pytest.mark.slow
@pytest.mark.parametrize(("name", "codes"), [("black hole", {0x53}), ("closed port", {0x4A})])
def test_a_server_that_cannot_be_reached_and_then_can(name: str, codes: set[int]) -> None:
    with PLACES[name]() as port, plc_at(port) as plc:
        until(plc, "Main.conn.Error")
        assert plc.read("Main.conn.Error_Code") in codes
        assert plc.read("Main.conn.Waiting_Server") is True
        with real(ModbusPeer(held())) as good:
            plc.units[0].network.map = AddressMap({SERVER: Peer("127.0.0.1", good)}, "127.0.0.1")  # type: ignore[attr-defined]
            assert read(plc) == "ok"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["black hole", "closes between requests", "floods from the start", "slow"])
def test_a_journal_of_real_connections_is_done_again(name: str) -> None:
    """To the bit, without the connections and without waiting."""
    file = io.StringIO()
    journal = Journal(file)
    with PLACES[name]() as port, plc_at(port, journal) as plc:
        plc.write("Main.Poll", True)
        run(plc, for_ns=SECOND_NS, pace="event")
        journal.close()
        memory = bytes(plc.memory.u8)
    replay = Replay(*open_journal(file.getvalue().splitlines(keepends=True)), image())
    assert (replay.run(), replay.differs, replay.plc.scans) == ("end", None, plc.scans)
    assert bytes(replay.plc.memory.u8) == memory


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="handles are counted in /proc")
@pytest.mark.parametrize("name", ["black hole", "closed port", "closes at once", "resets in mid-request"])
def test_many_lost_connections_leave_nothing_behind(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither handles nor objects, however connections end."""
    monkeypatch.setattr("fbvm.net.peers.MOST_KEPT", 10)  # of what the peer has heard and who has called
    with PLACES[name]() as port, plc_at(port) as plc:
        for wait in ("conn.Open_Time", "conn.Retry_Time", "rd.Reply_Time"):
            plc.write(f"Main.{wait}", 5_000_000)
        plc.write("Main.Poll", True)
        run(plc, for_ns=SECOND_NS, pace="event")
        gc.collect()
        gc.freeze()
        seen = []
        for _ in range(6):
            run(plc, for_ns=SECOND_NS, pace="event")
            gc.collect()
            seen.append((len(os.listdir("/proc/self/fd")), len(gc.get_objects())))
    handles, objects = zip(*seen, strict=True)
    assert max(handles[1:]) <= handles[0] + 2, "one is open or not, and the peer's"
    # Native code that comes from the background, or a module's first use, adds objects once; what connections leave
    # is more in every second.
    assert min(after - before for before, after in itertools.pairwise(objects)) <= 8


# --- no scan waits ----------------------------------------------------------------------------------------------------


class Guard:
    """Stands between the network and the host's sockets: counts calls of each scan, and refuses all that could wait."""

    CALLS = ("accept", "connect_ex", "recv", "recvfrom", "send", "sendto")

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.calls: Counter[str] = Counter()
        self.most: Counter[str] = Counter()
        self.scanning = False
        guard = self

        def guarded(name: str) -> Callable[..., Any]:
            def call(sock: socket.socket, *arguments: Any) -> Any:
                assert sock.gettimeout() == 0, f"{name} could wait"
                guard.calls[name] += 1
                return getattr(socket.socket, name)(sock, *arguments)

            return call

        forbidden = {name: never(name) for name in ("connect", "sendall", "makefile", "settimeout")}
        counted = type("Counted", (socket.socket,), {name: guarded(name) for name in self.CALLS} | forbidden)
        names = {**vars(socket), "socket": counted, "gethostbyname": never("gethostbyname")}
        for module in (fbvm.net.tcp, fbvm.net.udp):
            monkeypatch.setattr(module, "socket", SimpleNamespace(**names))
        monkeypatch.setattr(fbvm.net.switchboard, "select", SimpleNamespace(select=self._waiting))

    def _waiting(self, *arguments: Any) -> Any:
        assert not self.scanning, "select could wait"
        return select.select(*arguments)

    def watch(self, network: TcpNetwork) -> None:
        """The selector of this network must not wait during a scan."""
        select = network._selector.select

        def guarded(timeout: float | None = None) -> Any:
            assert timeout == 0 or not self.scanning, "select could wait"
            self.calls["select"] += self.scanning
            return select(timeout)

        network._selector.select = guarded  # type: ignore[method-assign]

    def scan(self, plc: Plc) -> None:
        """One scan, now."""
        self.calls.clear()
        self.scanning = True
        plc.scan(time.monotonic_ns())
        self.scanning = False
        for name, count in self.calls.items():
            self.most[name] = max(self.most[name], count)


def never(name: str) -> Callable[..., None]:
    def call(*arguments: Any) -> None:
        raise AssertionError(f"{name} could wait")

    return call


SCANS = times(700)


@pytest.mark.slow
@pytest.mark.parametrize("name", PLACES)
def test_no_scan_waits_for_anybody(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every call to the host returns at once, and the number of calls in a scan is small whatever comes in."""
    with PLACES[name]() as port, monkeypatch.context() as patch, plc_at(port) as plc:
        guard = Guard(patch)
        network = plc.units[0].network
        assert isinstance(network, TcpNetwork)
        guard.watch(network)
        plc.write("Main.Poll", True)
        for _ in range(SCANS):
            guard.scan(plc)
            network.wait(0.001)
        assert plc.trap is None
    assert guard.most["connect_ex"] == 1
    assert guard.most["select"] <= 1, "none where the wait before has looked"
    assert guard.most["send"] <= 1
    assert guard.most["recv"] <= 18, "closing throws away at most sixteen portions"
    assert sum(guard.most.values()) <= 24


@pytest.mark.slow
@pytest.mark.parametrize("name", ["black hole", "silent", "floods from the start"])
def test_how_long_scans_took_is_known(name: str) -> None:
    with PLACES[name]() as port, plc_at(port) as plc:
        plc.write("Main.Poll", True)
        assert run(plc, scans=150) == "scans"
        assert plc.scan_times.count == 150
        assert 0 < plc.scan_times.mean_ns <= plc.scan_times.longest_ns
        assert "scan time: " in str(plc.scan_times)
