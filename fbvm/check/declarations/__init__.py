"""Declarations: types, variables, initial values, configurations."""
