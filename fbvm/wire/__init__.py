"""Requests of units to a network, events of the network, and the Modbus codec.  No I/O in here."""
