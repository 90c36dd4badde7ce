"""The native engine: an Image becomes machine code over the flat memory, through LLVM."""
