"""Calls of POUs, standard functions and intrinsics, and their arguments."""
