"""Makes operations, without knowing a tree: the emitter, places, constants, conversions, the standard functions."""
