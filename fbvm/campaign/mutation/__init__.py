"""Mutants of the programs of a project, and what its tests make of them."""
