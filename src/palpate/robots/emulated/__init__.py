"""Simulated scenes behind emulated devices, as robots."""
