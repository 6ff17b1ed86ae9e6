"""Surfaces told apart by touch: a library, what speaks for each, the next best touch."""
