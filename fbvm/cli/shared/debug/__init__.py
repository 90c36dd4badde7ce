"""What a debugger opens, and the door through which it attaches to a PLC that runs."""
