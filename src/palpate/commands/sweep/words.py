"""Times in words."""

MINUTE, HOUR = 60.0, 3600.0


def time_text(seconds: float) -> str:
    """Return a time [s] with two digits or so, in a unit that suits it."""
    if seconds < 10.0:
        return f"{seconds:.2g} s"
    if seconds < 1.5 * MINUTE:
        return f"{seconds:.0f} s"
    if seconds < 1.5 * HOUR:
        return f"{seconds / MINUTE:.0f} min"
    return f"{seconds / HOUR:.2g} h" if seconds < 100 * HOUR else f"{seconds / HOUR / 24:.0f} days"
