"""Rub a surface: friction and how it bears torque."""
