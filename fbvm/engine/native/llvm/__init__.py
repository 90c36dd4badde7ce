"""LLVM by way of llvmlite: compiles text, stores and loads objects, and makes entry points that Python calls."""
