"""What happened inside each scan, and renderings of it: the chart for terminals and tests, captures of the network."""
