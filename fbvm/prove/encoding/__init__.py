"""Scans as terms: what the operations of an Image do to cells of memory, for all values at once."""
