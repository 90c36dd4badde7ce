"""Projects of CX-Programmer to source files."""
