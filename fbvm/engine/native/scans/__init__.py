"""Whole scans in machine code: what a scan does besides its tasks, with and without units."""
