"""Simulation, speed against error: run by `python benchmarks/simulation`."""
