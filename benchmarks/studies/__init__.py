"""The studies of `python benchmarks/bench.py`, one topic each, and the report they share."""
