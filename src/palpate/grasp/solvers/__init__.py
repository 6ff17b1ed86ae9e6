"""Solvers of grasp forces."""
