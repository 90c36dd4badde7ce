"""Project files of CX-Programmer: `.cxt`, a text, and `.cxp`, the same text compressed.  Omron documents neither."""
