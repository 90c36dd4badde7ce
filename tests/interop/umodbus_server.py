"""A Modbus TCP server by uModbus, in a process of its own: prints its port.  Status 77 where it is not installed."""

import socketserver
import sys
from collections.abc import Sequence
from functools import partial

from tables import COILS, DISCRETE_INPUTS, HOLDING_REGISTERS, INPUT_REGISTERS

COIL_FUNCTIONS, REGISTER_FUNCTIONS = (5, 15), (6, 16)


class Server(socketserver.ThreadingMixIn, socketserver.TCPServer):
    daemon_threads = True


def read(table: Sequence[int], slave_id: int, function_code: int, address: int) -> int:
    return table[address]


def main() -> None:
    try:
        from umodbus.server.tcp import RequestHandler, get_server
    except ImportError:
        sys.exit(77)
    server = get_server(Server, ("127.0.0.1", 0), RequestHandler)
    coils, registers = bytearray(COILS), list(HOLDING_REGISTERS)
    tables = {1: coils, 2: DISCRETE_INPUTS, 3: registers, 4: INPUT_REGISTERS}
    for function, table in tables.items():
        server.route(None, [function], None)(partial(read, table))

    @server.route(None, COIL_FUNCTIONS, None)
    def write_coil(slave_id: int, function_code: int, address: int, value: int) -> None:
        coils[address] = bool(value)

    @server.route(None, REGISTER_FUNCTIONS, None)
    def write_register(slave_id: int, function_code: int, address: int, value: int) -> None:
        registers[address] = value & 0xFFFF

    print(server.server_address[1], flush=True)
    server.serve_forever()


if __name__ == "__main__":
    main()
