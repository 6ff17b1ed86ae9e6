"""Real devices: nothing yet."""
