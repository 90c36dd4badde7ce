"""Verbs that run PLCs: run, demo, serve, map, peer, step, replay."""
