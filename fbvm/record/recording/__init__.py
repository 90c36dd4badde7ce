"""Recordings of runs: keyframes and inputs, and any scan of them executed again."""
