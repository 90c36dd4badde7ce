"""`fbvm fmt`: text to canonical text."""
