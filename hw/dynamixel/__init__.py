"""A hand of Dynamixel servos on one bus."""
