"""The instruction set of ladder, which drawings, mnemonics and the recovery from syntax errors share."""
