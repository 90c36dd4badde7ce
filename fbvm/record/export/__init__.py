"""Formats of other tools: VCD, pcapng."""
