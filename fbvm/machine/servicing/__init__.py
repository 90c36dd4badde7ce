"""Peripheral servicing: FINS commands that reach the CPU unit, and the network instructions of its program."""
