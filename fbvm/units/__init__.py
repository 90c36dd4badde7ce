"""Emulated communication units: memory + events + time -> memory + requests.  They never see a program."""
