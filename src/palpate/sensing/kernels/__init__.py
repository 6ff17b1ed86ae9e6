"""Compiled inner loops of contact sensing: numba, no Python objects."""
