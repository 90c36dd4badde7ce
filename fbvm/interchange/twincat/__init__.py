"""TwinCAT's files: objects (`.TcPOU`, `.TcDUT`, `.TcGVL`, `.TcIO`, `.TcTTO`) and projects (`.plcproj`), read as sources."""

PROJECT_SUFFIX = ".plcproj"
