"""Prints how many Modbus exchanges a second there are: python tests/bench/exchanges.py.  Gates nothing.

Everybody reads the same ten registers of the same server, which is C in a process of its own, again and again, over a
connection of 127.0.0.1; rounds take turns, and the median counts.  The limit is C that does nothing but send and receive.
Modbus clients spend their time in their own code around the same two calls.  The blocks do it as on the device: switch,
sending flag, reply in the unit, receive switch, words in memory, which is several scans an exchange however quick a scan
is; what they pay besides is those scans' machine."""

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

from fbvm import Etn21, Peer, Plc, TcpNetwork, compile_files  # noqa: E402
from fbvm.code.image import Image  # noqa: E402
from fbvm.run import run  # noqa: E402

BENCH = Path(__file__).resolve().parent
SERVER = Peer("192.168.250.1", 502)
ROUNDS, ROUND_MS = 7, 400
CYCLES_MS = (1, 10)
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


def clients(stack: ExitStack, binary: Path, port: int) -> dict[str, Exchange]:
    """Everybody, by what is printed."""
    found: dict[str, Exchange] = {"C that only sends and receives": in_c(binary, "plain", port)}
    if subprocess.run([str(binary), "libmodbus", str(port), "1"], stdout=subprocess.DEVNULL).returncode == 0:
        found["libmodbus, in C"] = in_c(binary, "libmodbus", port)
    found["pyModbusTCP"] = pymodbus_tcp(stack, port)
    found["pymodbus, plain client"] = pymodbus(stack, port)
    compilation = compile_files([BENCH / "poll.st"], runnable=True)
    assert compilation.image
    for engine in ("native", "python"):
        found[f"blocks, {engine}, event"] = Blocks(stack, compilation.image, port, engine, "event", 10)
        for cycle_ms in CYCLES_MS:
            title = f"blocks, {engine}, cyclic {cycle_ms} ms"
            found[title] = Blocks(stack, compilation.image, port, engine, "cyclic", cycle_ms)
    return found


def main() -> None:
    print(f"Python {sys.version.split()[0]} on {sys.platform}; exchanges a second over 127.0.0.1, median of {ROUNDS}")
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        binary = Path(folder) / "modbus"
        subprocess.run(["cc", "-O2", "-o", str(binary), str(BENCH / "programs" / "modbus.c"), "-ldl"], check=True)
        port = stack.enter_context(server(binary))
        everybody = clients(stack, binary, port)
        rates: dict[str, list[float]] = {name: [] for name in everybody}
        for _ in range(ROUNDS):
            for name, exchange in everybody.items():
                rates[name].append(exchange(ROUND_MS) / ROUND_MS * 1e3)
        best = statistics.median(rates["C that only sends and receives"])
        plain = statistics.median(rates["pymodbus, plain client"])
        print(f"{'':<34}{'exchanges/s':>12}{'of C':>8}{'of pymodbus':>13}{'scans each':>12}")
        for name, found in rates.items():
            rate, client = statistics.median(found), everybody[name]
            scans = f"{client.scans / client.done:.1f}" if isinstance(client, Blocks) and client.done else ""
            print(f"{name:<34}{rate:>12,.0f}{rate / best:>8.2f}{rate / plain:>13.2f}{scans:>12}")


if __name__ == "__main__":
    main()
