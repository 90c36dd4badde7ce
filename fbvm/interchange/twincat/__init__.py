"""TwinCAT's files: objects (`.TcPOU`, `.TcDUT`, `.TcTLEO`, `.TcGVL`, `.TcIO`, `.TcTTO`) projects (`.plcproj`) and systems
(`.tsproj`), read as sources."""

PROJECT_SUFFIX, SYSTEM_SUFFIX = ".plcproj", ".tsproj"
OBJECT_SUFFIXES = (".tcpou", ".tcdut", ".tcgvl", ".tcio", ".tctleo")
"""Endings of files that hold declarations or bodies, in small letters."""
TASK_SUFFIX = ".tctto"
TASKS = "Tasks.st"
"""What the source is called that says which programs run when."""
