"""Robot files, and the back ends that they describe."""
