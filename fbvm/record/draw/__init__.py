"""Renderings for people: the time chart, the scan table, rungs, charts, causes."""
