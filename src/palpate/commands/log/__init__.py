"""Logs: what is in them, as data sets."""
