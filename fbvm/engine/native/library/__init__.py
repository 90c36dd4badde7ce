"""Routines that machine code calls, such as those that read and write values as text."""
