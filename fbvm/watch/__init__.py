"""Access to a PLC's memory by name: paths and addresses, values, conditions."""
