"""A Modbus TCP server by libmodbus, in a process of its own: prints its port, serves one connection after another.

Holding register i holds 1000 + i.  Ends with status 77 where libmodbus is not installed.
"""

import ctypes
import ctypes.util
import os
import socket
import sys

REGISTERS = 65536
LONGEST_ADU = 260


class Mapping(ctypes.Structure):
    """modbus_mapping_t of libmodbus 3.1."""

    _fields_ = (
        *((f"{what}_{table}", ctypes.c_int)
          for table in ("bits", "input_bits", "input_registers", "registers") for what in ("nb", "start")),
        *((f"tab_{table}", ctypes.c_void_p) for table in ("bits", "input_bits", "input_registers")),
        ("tab_registers", ctypes.POINTER(ctypes.c_uint16)),
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
        "modbus_close": (ctypes.c_void_p,),
    }.items():
        getattr(library, function).argtypes = arguments
    return library


def main() -> None:
    library = load()
    context = library.modbus_new_tcp(b"127.0.0.1", 0)
    mapping = library.modbus_mapping_new(REGISTERS, REGISTERS, REGISTERS, REGISTERS)
    for number in range(REGISTERS):
        mapping.contents.tab_registers[number] = 1000 + number & 0xFFFF
    listener = library.modbus_tcp_listen(context, 1)
    with socket.socket(fileno=os.dup(listener)) as copy:
        print(copy.getsockname()[1], flush=True)
    query = ctypes.create_string_buffer(LONGEST_ADU)
    while True:
        number = ctypes.c_int(listener)
        library.modbus_tcp_accept(context, ctypes.byref(number))
        while (length := library.modbus_receive(context, query)) >= 0:
            if length:
                library.modbus_reply(context, query, length, mapping)
        library.modbus_close(context)


if __name__ == "__main__":
    main()
