"""Stepping: a PLC whose program stands still at any statement of any scan, and can go back."""
