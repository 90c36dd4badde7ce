"""Prints how many Modbus exchanges a second there are: python tests/bench/exchanges.py.  Gates nothing.

Everybody reads the same ten registers of the same server, which is C in a process of its own, again and again, over a
connection of 127.0.0.1; rounds take turns, and the median counts.  The limit is C that does nothing but send and receive:
what the host's network and two changes of processes cost.  Modbus clients add their own code around the same two calls;
pymodbus's plain client adds about as much again.

The blocks do it as on the device: send switch, sending flag, data-received flag, receive switch, words in memory.  That is five
scans an exchange: a unit finishes what it accepted one refresh later, a program sees it in the next scan, and the block asks for
data when the unit says that they are there.  Scans that follow at once are one burst of machine code, the unit's own program
among it (0.3 us a refresh, as much as the block's), and what wakes a PLC is fetched before its program runs.  So Python is
called twice an exchange: when the reply has come, and when the next request is to be sent.  It executes some 2,200 of its
instructions then, in equal parts for the loop with its clock, goal and times, for the connection, for the rows that the unit's
program and the network exchange, and for the burst; send, wait and receive are one call of the host each, as in any client.

Where the host lets its processors sleep between two changes of processes the blocks reach 1.1 to 1.2 times pymodbus's rate
(one x86-64 machine: 1.12, 1.19, 1.20; 8,600 to 10,400 a second beside 7,200 to 9,100; in a disturbed minute 0.72), and two
thirds of what C does that does nothing else.  Where changes of processes are quick, because the machine is busy, whoever
computes least wins: pymodbus does 33,000 a second there with 20 us of its own, the blocks 18,000 to 20,000 with 35, three
fifths.  What is left would have to go out of Python's loop and connections.  A server in Python, as most simulators are,
takes the difference away: the second table.  In `cyclic` pace an exchange takes four periods, whatever everybody's speed."""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

HOUSE = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(HOUSE))
sys.path.insert(0, str(HOUSE / "tests" / "bench"))

import native  # noqa: E402

from fbvm import Etn21, Peer, Plc, TcpNetwork, compile_files  # noqa: E402
from fbvm.cli.running.demo import modbus_server  # noqa: E402
from fbvm.code.image import Image  # noqa: E402
from fbvm.processor.processor import contract  # noqa: E402
from fbvm.run import run  # noqa: E402
from fbvm.units.etn21.inside import PROGRAM as ETN21_PROGRAM  # noqa: E402

BENCH = Path(__file__).resolve().parent
SERVER = Peer("192.168.250.1", 502)
ROUNDS, ROUND_MS = 7, 400
CYCLES_MS = (1, 10)
BEST, LIBMODBUS, PLAIN = "C that only sends and receives", "libmodbus, in C", "pymodbus, plain client"
Exchange = Callable[[int], int]
"""Exchanges for so many milliseconds; how many there were."""


@contextmanager
def server(binary: Path) -> Iterator[int]:
    """The server in C; its port."""
    with subprocess.Popen([str(binary), "serve"], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout
        try:
            yield int(process.stdout.readline())
        finally:
            process.terminate()


def in_c(binary: Path, what: str, port: int) -> Exchange:
    return lambda time_ms: int(subprocess.check_output([str(binary), what, str(port), str(time_ms)]))


def repeated(once: Callable[[], object]) -> Exchange:
    def exchange(time_ms: int) -> int:
        end, done = time.perf_counter() + time_ms / 1e3, 0
        while time.perf_counter() < end:
            once()
            done += 1
        return done

    return exchange


def pymodbus(stack: ExitStack, port: int) -> Exchange:
    from pymodbus.client import ModbusTcpClient

    client = ModbusTcpClient("127.0.0.1", port=port)
    stack.callback(client.close)
    assert client.connect()
    assert client.read_holding_registers(0, count=10).registers == list(range(1000, 1010))
    return repeated(lambda: client.read_holding_registers(0, count=10))


def pymodbus_tcp(stack: ExitStack, port: int) -> Exchange:
    from pyModbusTCP.client import ModbusClient

    client = ModbusClient("127.0.0.1", port=port)
    stack.callback(client.close)
    assert client.read_holding_registers(0, 10) == list(range(1000, 1010))
    return repeated(lambda: client.read_holding_registers(0, 10))


class Blocks:
    """MTCP_ETN_Fn03 on a PLC: its exchanges, and its scans."""

    def __init__(self, stack: ExitStack, image: Image, port: int, engine: str, pace: str, cycle_ms: int) -> None:
        if engine == "native":
            native.optimise(image, contract(ETN21_PROGRAM).image)
        network = TcpNetwork({SERVER: ("127.0.0.1", port)})
        stack.callback(network.close)
        self.plc = Plc(image, cycle_ms * 1_000_000, engine=engine)
        self.plc.attach(Etn21(0, "192.168.250.21"), network)
        self.pace = pace
        self.scans = self.done = 0
        assert run(self.plc, until="Main.Exchanges > 10", pace=pace, max_ns=10_000_000_000) == "until"
        assert self.plc.read("D200..D209") == list(range(1000, 1010))

    def __call__(self, time_ms: int) -> int:
        scans, before = self.plc.scans, int(str(self.plc.read("Main.Exchanges")))
        assert run(self.plc, for_ns=time_ms * 1_000_000, pace=self.pace) == "time"
        done = int(str(self.plc.read("Main.Exchanges"))) - before
        self.scans += self.plc.scans - scans
        self.done += done
        return done


def poll() -> Image:
    """A program that reads again and again."""
    compilation = compile_files([BENCH / "poll.st"], runnable=True)
    assert compilation.image
    return compilation.image


def clients(stack: ExitStack, binary: Path, port: int) -> dict[str, Exchange]:
    """Everybody, by what is printed."""
    found: dict[str, Exchange] = {BEST: in_c(binary, "plain", port)}
    if subprocess.run([str(binary), "libmodbus", str(port), "1"], stdout=subprocess.DEVNULL).returncode == 0:
        found[LIBMODBUS] = in_c(binary, "libmodbus", port)
    found["pyModbusTCP"] = pymodbus_tcp(stack, port)
    found[PLAIN] = pymodbus(stack, port)
    for engine in ("native", "python"):
        found[f"blocks, {engine}, event"] = Blocks(stack, poll(), port, engine, "event", 10)
        for cycle_ms in CYCLES_MS:
            title = f"blocks, {engine}, cyclic {cycle_ms} ms"
            found[title] = Blocks(stack, poll(), port, engine, "cyclic", cycle_ms)
    return found


def measure(everybody: dict[str, Exchange]) -> tuple[dict[str, list[float]], dict[str, list[float]]]:
    """Rounds in turn: exchanges a second of each, and its own processor time for one, in microseconds."""
    rates: dict[str, list[float]] = {name: [] for name in everybody}
    used: dict[str, list[float]] = {name: [] for name in everybody}
    for _ in range(ROUNDS):
        for name, exchange in everybody.items():
            began = time.process_time()
            done = exchange(ROUND_MS)
            used[name].append((time.process_time() - began) / max(done, 1) * 1e6)
            rates[name].append(done / ROUND_MS * 1e3)
    return rates, used


def compare(everybody: dict[str, Exchange]) -> None:
    """A table."""
    rates, used = measure(everybody)
    best, plain = (statistics.median(rates.get(name, [0])) for name in (BEST, PLAIN))
    print(f"{'':<34}{'exchanges/s':>12}{'of C':>8}{'of pymodbus':>13}{'own CPU, us':>13}{'scans each':>12}")
    for name, found in rates.items():
        rate, client = statistics.median(found), everybody[name]
        scans = f"{client.scans / client.done:.1f}" if isinstance(client, Blocks) and client.done else ""
        own = "" if name in (BEST, LIBMODBUS) else f"{statistics.median(used[name]):,.0f}"
        of_c = f"{rate / best:.2f}" if best else ""
        print(f"{name:<34}{rate:>12,.0f}{of_c:>8}{rate / plain:>13.2f}{own:>13}{scans:>12}")


def main() -> None:
    print(f"Python {sys.version.split()[0]} on {sys.platform}; exchanges a second over 127.0.0.1, median of {ROUNDS}")
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        binary = Path(folder) / "modbus"
        subprocess.run(["cc", "-O2", "-o", str(binary), str(BENCH / "programs" / "modbus.c"), "-ldl"], check=True)
        port = stack.enter_context(server(binary))
        compare(clients(stack, binary, port))
    print("\nthe same with a server in Python, pymodbus's")
    with ExitStack() as stack:
        port = stack.enter_context(modbus_server())
        compare({PLAIN: pymodbus(stack, port), "blocks, native, event": Blocks(stack, poll(), port, "native", "event", 10)})


if __name__ == "__main__":
    main()
