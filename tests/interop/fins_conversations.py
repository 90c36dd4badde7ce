"""What clients of other people say to a PLC by FINS, each in a process whose path has that client only.

`fins` and `fins-driver` have the same module name.  Prints one JSON object with what the client got; called with the client's
name, address and port."""

from __future__ import annotations

import json
import sys


def fins_udp(host: str, port: int) -> dict[str, object]:
    from fins.udp import UDPFinsConnection

    plc = UDPFinsConnection()
    plc.connect(host, port, bind_port=0)
    plc.dest_node_add, plc.srce_node_add = 1, 25
    return _fins(plc)


def fins_tcp(host: str, port: int) -> dict[str, object]:
    from fins.tcp import TCPFinsConnection

    plc = TCPFinsConnection()
    plc.connect(host, port, connection_timeout=10)
    found = _fins(plc)
    return found | {"nodes": [plc.srce_node_add, plc.dest_node_add]}


def _fins(plc: object) -> dict[str, object]:
    plc.write(41, "d", 500, "ui")
    plc.write(1.5, "d", 510, "r")
    answer, twice = 0, 0.0
    while answer != 42 or twice != 3.0:
        answer, twice = plc.read("d", 501, "ui"), plc.read("d", 512, "r")
    words = plc.read("d", 100, "ui", 3)
    data, status = plc.cpu_unit_data_read(), plc.cpu_unit_status_read()
    modes = [plc.change_to_program_mode()[12:14].hex(), plc.change_to_run_mode()[12:14].hex()]
    return {"answer": answer, "twice": twice, "words": words, "model": data[14:29].decode(), "status": status[14:16].hex(),
            "modes": modes}  # fmt: skip


def fins_driver(host: str, port: int) -> dict[str, object]:
    from fins import FinsClient

    plc = FinsClient(host, port)
    plc.connect()
    written = plc.memory_area_write("D500", (41).to_bytes(2, "big"), 1)
    answer = b""
    while answer != b"\0\x2a":
        answer = plc.memory_area_read("D501").data
    read = plc.memory_area_read("D100", 3)
    several = plc.multiple_memory_area_read("D100", "D102")
    filled = plc.memory_area_fill("D600", b"\xab\xcd", 10)
    moved = plc.memory_area_transfer("D600", "D700", 10)
    stopped, ran = plc.stop(), plc.run("run")
    return {"answer": answer.hex(), "words": read.data.hex(), "several": [bytes(item).hex() for item in several.data],
            "copied": plc.memory_area_read("D709", 2).data.hex(),
            "ok": [reply.ok for reply in (written, read, several, filled, moved, stopped, ran)]}  # fmt: skip


def finscommand(host: str, port: int) -> dict[str, object]:
    from finscommand import client

    client.fins.__del__ = lambda self: self.sock.close()  # it has a misspelt name there
    plc = client.fins(host)
    plc.write("D1000", bytes(range(256)) * 10)
    words = plc.read("D1000", 1280)
    return {"words": words == bytes(range(256)) * 10, "fixed": plc.read("D100", 3).hex(), "empty": len(plc.read("D100", 990))}


if __name__ == "__main__":
    _, name, where, number = sys.argv
    print(json.dumps(globals()[name](where, int(number))))
