"""Surface maps, error, honesty and cost: run by `python benchmarks/mapping_surface`."""
