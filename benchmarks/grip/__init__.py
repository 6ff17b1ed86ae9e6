"""Grips in simulation: leagues, long holds, onset of slip, held tools and objects."""
