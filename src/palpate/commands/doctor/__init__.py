"""Examine a robot's devices and this computer."""
