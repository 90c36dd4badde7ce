"""Running PLCs by the clock of the host: the only room that knows what time it really is."""
