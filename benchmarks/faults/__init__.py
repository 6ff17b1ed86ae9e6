"""Faults of every kind, at random moments: one table that tests and the campaign draw from."""
