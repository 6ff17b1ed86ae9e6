"""Grasp forces that hold with a chosen probability."""
