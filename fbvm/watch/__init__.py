"""What somebody outside asks of a PLC's memory: places by name or address, their values, conditions about them."""
