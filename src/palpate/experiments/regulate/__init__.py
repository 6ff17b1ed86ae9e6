"""Hold a force on a surface."""
