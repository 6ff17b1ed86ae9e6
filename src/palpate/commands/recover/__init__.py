"""Bring a robot's devices back after a stop."""
