"""FINS: frames, their TCP framing, memory areas, commands and end codes, and a line of text about each frame."""
