"""Recording and reading: what happened scan by scan, in memory and in files."""
