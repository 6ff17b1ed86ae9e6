"""Shapes, a fast map, and the two ways to explore that `benchmarks/active.py` compares. Millimetres throughout."""
