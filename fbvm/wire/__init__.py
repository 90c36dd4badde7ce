"""What a unit asks of a network and is told by it, and the Modbus codec.  No I/O in here."""
