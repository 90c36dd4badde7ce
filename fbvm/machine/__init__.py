"""One PLC: memory, program, units and network, one scan at a time."""
