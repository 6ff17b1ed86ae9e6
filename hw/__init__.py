"""Real devices, and emulators of them that speak the same protocols."""
