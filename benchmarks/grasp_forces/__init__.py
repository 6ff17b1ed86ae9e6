"""Grasp forces, speed against error: run by `python benchmarks/grasp.py`."""
