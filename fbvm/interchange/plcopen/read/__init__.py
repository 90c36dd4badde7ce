"""PLCopen XML to source files."""
