"""Source files to PLCopen XML."""
