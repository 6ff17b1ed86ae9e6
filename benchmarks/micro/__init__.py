"""Wanted micro-motions in simulation: the runs behind `benchmarks/micro_motions.py`."""
