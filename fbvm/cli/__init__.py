"""The command line: one module for each verb, in four folders, and what verbs share in `shared/`."""
