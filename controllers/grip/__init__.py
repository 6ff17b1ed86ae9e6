"""Grip control that neither slips nor spins, with the least force that does it."""
