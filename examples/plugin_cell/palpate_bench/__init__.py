"""Devices of a bench, for palpate."""
