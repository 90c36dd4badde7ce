"""Expressions: their types, constants, references, and what may be assigned to what."""
