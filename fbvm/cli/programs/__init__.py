"""Verbs about sources: check, fmt, list, ladder, sfc, explain, import, export."""
