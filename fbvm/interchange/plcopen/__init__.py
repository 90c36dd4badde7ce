"""Programs from and to other tools: PLCopen TC6 XML."""
