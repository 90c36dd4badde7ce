"""Campaigns over tests: pytest executes the same tests again and again, each time under other conditions."""
