"""Lowering: a checked tree to operations.  Every meaning is decided here."""
