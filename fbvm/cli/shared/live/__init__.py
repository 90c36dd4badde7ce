"""The page of a running PLC for the verbs that have one: what is run, from which files, and the page itself."""
