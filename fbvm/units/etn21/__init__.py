"""The Omron ETN21 Ethernet unit."""
