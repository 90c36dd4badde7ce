"""A Modbus TCP server by pyModbusTCP, in a process of its own: prints its port.  Status 77 where it is not installed."""

import sys
import time

from tables import COILS, DISCRETE_INPUTS, HOLDING_REGISTERS, INPUT_REGISTERS


def main() -> None:
    try:
        from pyModbusTCP.server import ModbusServer
    except ImportError:
        sys.exit(77)
    server = ModbusServer(host="127.0.0.1", port=0, no_block=True)
    server.data_bank.set_coils(0, [bool(bit) for bit in COILS])
    server.data_bank.set_discrete_inputs(0, [bool(bit) for bit in DISCRETE_INPUTS])
    server.data_bank.set_holding_registers(0, HOLDING_REGISTERS)
    server.data_bank.set_input_registers(0, INPUT_REGISTERS)
    server.start()
    print(server._service.server_address[1], flush=True)
    while True:
        time.sleep(60)


if __name__ == "__main__":
    main()
