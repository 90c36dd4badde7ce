"""Processors of units: a unit that is itself a program runs it over a memory of its own."""
