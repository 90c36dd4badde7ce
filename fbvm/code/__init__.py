"""The typed code: its table of operations, the Image that carries it, lowering from a checked tree, the listing."""
