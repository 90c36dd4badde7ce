"""Files of all formats as sources."""
