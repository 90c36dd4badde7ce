"""LLVM text for each operation of code: one row an operation."""
