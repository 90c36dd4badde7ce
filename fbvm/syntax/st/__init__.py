"""Structured Text: characters to tokens, tokens to a tree."""
