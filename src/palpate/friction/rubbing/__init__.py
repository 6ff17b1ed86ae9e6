"""Friction parameters from strokes and twists: mu, e, their dependence on load, and their uncertainty."""
