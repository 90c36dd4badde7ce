"""Engines: an Image and a memory become running code."""
