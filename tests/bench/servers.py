"""Prints how many Modbus requests a second servers answer: python tests/bench/servers.py.  Gates nothing.

Clients in C read the same ten registers again and again over 127.0.0.1: one, then eight at once, then a hundred that
connect, ask once and leave, one after the other.  Rounds take turns, and the median counts.  The limit is a server in C that
only answers 03 from a formula; libmodbus's does its work through a Python loop around its two calls, as everybody has to
write one; pymodbus's is asyncio.

Our servers do it as on the device, in ST that meets its unit through memory words.  What a request costs is in the second
table: its scans, and what they consist of.  The ETN21 takes four: the receive ends in one I/O refresh, the next scan composes
the reply and asks for the send, the refresh after that ends it, the scan then asks for the next receive, and that has to be
accepted.  A mailbox port takes two: bytes come and go in the refresh itself, so that one scan answers what the refresh before
it has brought; a third, once its words have come to rest, finds nothing new.  The logic is a few microseconds of machine code,
with that of the ETN21's own processor, a tenth of it all at the most; the rest is Python around it: the unit (rows of what it and
the network tell each other, and in a mailbox port its words and checks), the network (a read and a write, with the selector
between), and the loop; the machine between them is one call a burst.

So with one client a server of ours answers as often as pymodbus's or more on a quiet host: 1.9 times as often with an ETN21 that
has one socket open, 1.4 with eight, 1.1 with a mailbox port, which is half to nine tenths of C's; on a busy one, where changes
of processes cost less, whoever computes least wins.
With eight clients the ETN21's areas for receiving and sending, which are there once, go from socket to socket; the slots of
a mailbox port are served side by side, so that several requests share a scan (0.3 each).  On a machine with other work a
request took 14.8 us of processor time with an ETN21 then, 31 with pymodbus's server (as much with its older kind of data
store), 8 with C's.  Of 12.5 us, without the waking of clients, the kernel takes 4.4 (a send 3.4, a receive 0.9, a share of
epoll), machine code 1.1, Python 7; one burst of 19 scans answers all eight.  Who connects, asks once and leaves costs a close
and a listen with their answers from the network, each a scan or more; with one socket others are refused meanwhile and try
anew, which takes most of the time.
Processor times are less disturbed by whatever else runs than rates are."""

from __future__ import annotations

import json
import signal
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

HOUSE = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(HOUSE))
sys.path.insert(0, str(HOUSE / "tests" / "interop"))
sys.path.insert(0, str(HOUSE / "tests" / "bench"))

import native  # noqa: E402

from fbvm import Etn21, Noc, Peer, Plc, TcpNetwork, Tianxing, compile_text  # noqa: E402
from fbvm.engine.native.scans import scans as native_scans  # noqa: E402
from fbvm.processor.processor import contract  # noqa: E402
from fbvm.run import run  # noqa: E402
from fbvm.units.etn21.inside import PROGRAM as ETN21_PROGRAM  # noqa: E402

BENCH = Path(__file__).resolve().parent
ROUNDS, ROUND_MS, IN_TURN, AT_ONCE = 5, 400, 100, 8
ASK = bytes.fromhex("000100000006010300000001")
PROGRAMS: dict[str, tuple[Callable[[], Any], str]] = {
    "etn_modbus, 1 socket": (Etn21, "Server : ETN_Modbus_Server; END_VAR Server(); END_PROGRAM"),
    "etn_modbus, 8 sockets": (Etn21, "Server : ETN_Modbus_Server; END_VAR Server(Sockets := 8); END_PROGRAM"),
    "mbp_mstr": (Noc, "Server : MSTR_Server; END_VAR Server(Sessions := 8); END_PROGRAM"),
    "mb_tcp_server": (Tianxing, "Server : MB_TCP_SERVER; c : TCP_CONNECTCONFIG; b, d : WORD; h, r : ARRAY[0..99] OF WORD; "
                      "END_VAR Server(CONNECT := c, COIL_DATAAREA := b, DISCRETE_DATAAREA := d, HOLDING_REG_DATAAREA := h, "
                      "INPUT_REG_DATAAREA := r); END_PROGRAM"),
}  # fmt: skip
FOR_ONE = {"etn_modbus, 1 socket", "mb_tcp_server"}
PARTS = ("logic", "unit", "network")
LONG_NS = 1 << 50


# --- a server of ours, in a process of its own --------------------------------------------------------------------------


def serve(name: str, is_measured: bool) -> None:
    """Runs until SIGTERM; then prints scans, and with measurement the processor time of each part, since SIGUSR1."""
    make, text = PROGRAMS[name]
    compilation = compile_text(f"PROGRAM Main VAR {text}")
    assert compilation.image
    native.optimise(compilation.image, contract(ETN21_PROGRAM).image)
    unit = make()
    network = TcpNetwork({Peer(unit.address, 502): ("127.0.0.1", 0)})
    used = dict.fromkeys((*PARTS, "scans", "all"), 0)
    if is_measured:
        found = native_scans._functions
        native_scans._functions = lambda *shape: tuple(timed(call, used, "logic") for call in found(*shape))  # type: ignore[assignment]
    plc = Plc(compilation.image, engine="native")
    plc.attach(unit, network)
    if is_measured:
        attached = plc.units[0]
        link = attached.link
        for part, owner, methods in (("unit", unit, ("refresh", "post", "finish")), ("network", link, ("events", "submit")),
                                     ("network", network, ("wait",))):  # fmt: skip
            for method in methods:
                if hasattr(owner, method):
                    setattr(owner, method, timed(getattr(owner, method), used, part))
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background of a shell ignores it
    signal.signal(signal.SIGTERM, lambda *_: signal.raise_signal(signal.SIGINT))
    signal.signal(signal.SIGUSR1, lambda *_: used.update(dict.fromkeys(PARTS, 0), scans=plc.scans, all=time.process_time_ns()))
    print(network.host_endpoint(Peer(unit.address, 502)).port, flush=True)
    run(plc, for_ns=LONG_NS, pace="event")  # as a server runs; with `until` somebody would have a turn behind each scan
    used.update(scans=plc.scans - used["scans"], all=time.process_time_ns() - used["all"])
    print(json.dumps(used), flush=True)


def timed(call: Callable[..., Any], used: dict[str, int], part: str) -> Callable[..., Any]:
    def measured(*arguments: Any, **named: Any) -> Any:
        began = time.process_time_ns()
        try:
            return call(*arguments, **named)
        finally:
            used[part] += time.process_time_ns() - began

    return measured


# --- who is compared ----------------------------------------------------------------------------------------------------


@contextmanager
def server(command: list[str], told: dict[str, int] | None = None) -> Iterator[int]:
    """A server in a process of its own; its port.  With `told` it is asked to measure; what it tells goes there."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=HOUSE) as process:
        assert process.stdout
        try:
            port = int(process.stdout.readline().rpartition(":")[2])
            settled(port)
            if told is not None:
                time.sleep(0.1)
                process.send_signal(signal.SIGUSR1)
            yield port
        finally:
            process.terminate()
            last = process.communicate()[0]
            if told is not None:
                told.update(json.loads(last))


def commands(binary: Path) -> dict[str, list[str]]:
    found = {
        "C that only answers": [str(binary), "serve"],
        "libmodbus": [sys.executable, str(HOUSE / "tests" / "interop" / "libmodbus_server.py")],
        "pymodbus": [sys.executable, "-m", "fbvm", "peer", "--port", "0"],
    }
    return found | {name: [sys.executable, __file__, "serve", name] for name in PROGRAMS}


def settled(port: int) -> None:
    """Wait until somebody is let in and answered."""
    while not once(port):
        time.sleep(0.001)


def once(port: int) -> bool:
    """Connect, ask, leave."""
    try:
        with socket.create_connection(("127.0.0.1", port), 10) as sock:
            sock.sendall(ASK)
            return len(sock.recv(64)) == 11
    except OSError:
        return False


def rate(binary: Path, port: int, clients: int) -> float:
    """Requests a second of so many clients at once."""
    settled(port)
    time.sleep(0.05)  # the socket that the last client left is opened again
    command = [str(binary), "plain", str(port), str(ROUND_MS)]
    processes = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(clients)]
    return sum(int(process.communicate()[0] or 0) for process in processes) / ROUND_MS * 1e3


def in_turn(port: int) -> float:
    """Clients a second that connect one after the other."""
    settled(port)
    began = time.perf_counter()
    for _ in range(IN_TURN):
        settled(port)
    return IN_TURN / (time.perf_counter() - began)


def compare(binary: Path) -> None:
    """Rounds in turn, and a table."""
    found: dict[str, tuple[list[float], list[float], list[float]]] = {}
    for _ in range(ROUNDS):
        for name, command in commands(binary).items():
            with server(command) as port:
                one, eight, turn = found.setdefault(name, ([], [], []))
                one.append(rate(binary, port, 1))
                if name not in FOR_ONE:
                    eight.append(rate(binary, port, AT_ONCE))
                turn.append(in_turn(port))
    pymodbus = statistics.median(found["pymodbus"][0])
    print(f"{'':<24}{'one client':>12}{'of pymodbus':>13}{f'{AT_ONCE} at once':>12}{f'{IN_TURN} in turn':>13}")
    for name, rows in found.items():
        one, eight, turn = (f"{statistics.median(row):,.0f}" if row else "" for row in rows)
        print(f"{name:<24}{one:>12}{statistics.median(rows[0]) / pymodbus:>13.2f}{eight:>12}{turn:>13}")


def look_inside(binary: Path) -> None:
    """What a request consists of: measured in runs of their own, as measuring takes time."""
    print(f"\n{'':<24}{'clients':>8}{'scans each':>12}{'CPU, us':>9}" + "".join(f"{part:>9}" for part in (*PARTS, "rest")))
    for name in PROGRAMS:
        for clients in (1,) if name in FOR_ONE else (1, AT_ONCE):
            told: dict[str, int] = {}
            with server([sys.executable, __file__, "serve", name, "measured"], told) as port:
                requests = rate(binary, port, clients) * ROUND_MS / 1e3
            whole = told["all"]
            shares = [told[part] / whole for part in PARTS]
            print(f"{name:<24}{clients:>8}{told['scans'] / requests:>12.1f}{whole / requests / 1e3:>9.0f}" + "".join(
                f"{share:>9.0%}" for share in (*shares, 1 - sum(shares))))  # fmt: skip


def main() -> None:
    if sys.argv[1:2] == ["serve"]:
        serve(sys.argv[2], "measured" in sys.argv)
        return
    print(f"Python {sys.version.split()[0]} on {sys.platform}; requests a second over 127.0.0.1, median of {ROUNDS}")
    with tempfile.TemporaryDirectory() as folder:
        binary = Path(folder) / "modbus"
        subprocess.run(["cc", "-O2", "-o", str(binary), str(BENCH / "programs" / "modbus.c"), "-ldl"], check=True)
        compare(binary)
        look_inside(binary)


if __name__ == "__main__":
    main()
