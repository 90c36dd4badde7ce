"""A debugger: steps through the statements of a program, scan by scan, forwards and backwards."""
