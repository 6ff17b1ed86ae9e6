"""LeRobot's dataset format v3.0, written with pyarrow alone."""
