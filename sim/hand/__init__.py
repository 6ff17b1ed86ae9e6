"""A Dynamixel hand, what it holds, and the back end that runs both."""
