"""Images on disk, and code of library blocks that is linked into each program."""
