"""A Modbus TCP server by libmodbus, in a process of its own: prints its port.

Ends with status 77 where libmodbus is not installed.
"""

import ctypes
import ctypes.util
import os
import select
import socket
import sys

from tables import COILS, COUNT, DISCRETE_INPUTS, HOLDING_REGISTERS, INPUT_REGISTERS


class Mapping(ctypes.Structure):
    """modbus_mapping_t of libmodbus 3.1."""

    _fields_ = (
        *((f"{what}_{table}", ctypes.c_int)
          for table in ("bits", "input_bits", "input_registers", "registers") for what in ("nb", "start")),
        *((f"tab_{table}", ctypes.POINTER(ctypes.c_uint8)) for table in ("bits", "input_bits")),
        *((f"tab_{table}", ctypes.POINTER(ctypes.c_uint16)) for table in ("input_registers", "registers")),
    )  # fmt: skip


def load() -> ctypes.CDLL:
    name = ctypes.util.find_library("modbus")
    if not name:
        sys.exit(77)
    library = ctypes.CDLL(name)
    library.modbus_new_tcp.restype = ctypes.c_void_p
    library.modbus_mapping_new.restype = ctypes.POINTER(Mapping)
    for function, arguments in {
        "modbus_tcp_listen": (ctypes.c_void_p, ctypes.c_int),
        "modbus_tcp_accept": (ctypes.c_void_p, ctypes.POINTER(ctypes.c_int)),
        "modbus_receive": (ctypes.c_void_p, ctypes.c_char_p),
        "modbus_reply": (ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.POINTER(Mapping)),
        "modbus_set_socket": (ctypes.c_void_p, ctypes.c_int),
    }.items():
        getattr(library, function).argtypes = arguments
    return library


def main() -> None:
    library = load()
    context = library.modbus_new_tcp(b"127.0.0.1", 0)
    mapping = library.modbus_mapping_new(COUNT, COUNT, COUNT, COUNT)
    for number in range(COUNT):
        mapping.contents.tab_bits[number] = COILS[number]
        mapping.contents.tab_input_bits[number] = DISCRETE_INPUTS[number]
        mapping.contents.tab_registers[number] = HOLDING_REGISTERS[number]
        mapping.contents.tab_input_registers[number] = INPUT_REGISTERS[number]
    listener = library.modbus_tcp_listen(context, 5)
    with socket.socket(fileno=os.dup(listener)) as copy:
        print(copy.getsockname()[1], flush=True)
    longest_adu = 260
    query = ctypes.create_string_buffer(longest_adu)
    numbers = [listener]
    while True:
        for number in select.select(numbers, [], [])[0]:
            if number == listener:
                numbers.append(library.modbus_tcp_accept(context, ctypes.byref(ctypes.c_int(listener))))
                continue
            library.modbus_set_socket(context, number)
            length = library.modbus_receive(context, query)
            if length > 0:
                library.modbus_reply(context, query, length, mapping)
            elif length < 0:
                os.close(number)
                numbers.remove(number)


if __name__ == "__main__":
    main()
