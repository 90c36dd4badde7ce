"""Sources of ours into a project that CX-Programmer saved."""
