"""A force/torque sensor with the faults of a real one."""
