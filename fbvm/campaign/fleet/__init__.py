"""Fleets: the equal PLCs of a project in several processes, of this machine or of a cluster, for load tests."""
