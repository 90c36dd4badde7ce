"""The parts of one scan: which tasks are due, the words that tell the program about time, the I/O refresh."""
