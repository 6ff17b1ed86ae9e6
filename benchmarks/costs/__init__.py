"""Costs in processor or wall time, each with one name: run by `python benchmarks/costs [NAME ...]`."""
