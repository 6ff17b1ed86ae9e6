"""Explore a surface by touch."""
