"""Wrenches into contacts."""
