"""Which engine runs an image, and how a run is stopped inside a scan."""
