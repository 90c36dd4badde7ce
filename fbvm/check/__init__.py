"""Names, types, constants and rules.  A tree stays a value; what is found out about it lives in side tables (`facts`)."""
