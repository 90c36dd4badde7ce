"""Rungs drawn with characters: a drawing to steps, and steps to a drawing."""
