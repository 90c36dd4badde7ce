"""Names of what the compiler adds to a program, and what others look for in the compiled one."""

ENDING = "FB_exit of all instances"
"""The body that calls FB_exit of all instances; no task and no other body executes it."""
