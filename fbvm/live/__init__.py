"""The page of a running PLC in a browser: what its users see and do there, and the messages by which it is told."""
