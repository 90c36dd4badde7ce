"""Traces: events and values of each scan, recorded in memory and in files, and read again."""
