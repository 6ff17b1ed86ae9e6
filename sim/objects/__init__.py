"""What is touched: primitives, meshes, height fields, a torus; still, moving or free."""
