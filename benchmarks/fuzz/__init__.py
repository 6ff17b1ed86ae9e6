"""Fuzz campaign: valid inputs, their damage, and the readers of outside input."""
