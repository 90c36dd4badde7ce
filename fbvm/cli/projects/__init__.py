"""Verbs about projects and lessons: new, test, learn."""
