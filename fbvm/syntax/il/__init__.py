"""The front end of the instruction list: lines of operators and operands to the statements that they stand for."""
