"""What verbs share that debug: what is opened, tests that are debugged, the door for an editor."""
