"""Verbs about recordings: chart, table, why, convert."""
