"""Roughness spectra by touch: an experiment for palpate."""
