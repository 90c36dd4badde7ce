"""The fast paths of a scan: machine code does one or many scans in one call."""
