"""Material recognition by touch: a library, the evidence for each material, the next best touch."""
