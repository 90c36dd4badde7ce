"""The verbs that editors start."""
