"""Compare maps with meshes, and runs with one another."""
