"""Parts of the fault campaign and the soak: one robot on the wire, its faults, and what must come of each."""
