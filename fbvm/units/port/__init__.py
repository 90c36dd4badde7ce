"""Units that a program meets through a mailbox: Schneider NOC, Tianxing."""
