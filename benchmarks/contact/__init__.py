"""Contact sensing, speed against error: run by `python benchmarks/contact`."""
