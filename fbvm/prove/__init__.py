"""Proof over the Image: whether a property holds in every scan, and the shortest run in which it does not."""
