"""A bus of Dynamixel servos that are not there, on a pseudo terminal."""
