"""Commands over the devices of a robot file: `robot`, `doctor`, `recover` and `emulate`."""
