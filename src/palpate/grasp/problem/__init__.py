"""Grasps, objectives and limits: the problem as it is stated."""
