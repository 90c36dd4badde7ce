"""The language server: what `analysis/` knows, told to editors by the Language Server Protocol (extra `editor`)."""
