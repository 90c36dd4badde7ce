"""PLCopen XML (TC6 2.01): `read/` makes source files of documents, `write/` documents of source files."""
