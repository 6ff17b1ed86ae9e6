"""Logs: what is in them, as tables."""
