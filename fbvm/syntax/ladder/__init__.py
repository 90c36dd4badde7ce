"""Ladder as mnemonics: text to steps, steps to statements, steps to canonical text."""
