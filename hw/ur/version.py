"""Versions of the controller's software, and what depends on them."""

Version = tuple[int, int, int, int]
"""Major, minor, bug fix, build."""

OLDEST = {3: (3, 15, 0, 0), 5: (5, 10, 0, 0), 10: (10, 10, 0, 0)}
"""Oldest by its major number: 3.15 is the last CB3 branch; freedrive by a program begins with 5.10; the script
port that the library uses on PolyScope X with 10.10."""

DASHBOARD_BELOW = 10
"""Major version from which there is no dashboard server."""


def cycle_rate(version: Version) -> float:
    """Return the controller's cycles per second: 125 for CB3, 500 for e-Series and later [Hz]."""
    return 125.0 if version[0] <= 3 else 500.0


def has_flange_sensor(version: Version) -> bool:
    """Return whether the arm measures the TCP force with a sensor in its flange: e-Series and later.

    A CB3 infers it from motor currents, which no fingertip's sensor can be checked by.
    """
    return version[0] >= 5


def has_raw_wrench(version: Version) -> bool:
    """Return whether ft_raw_wrench exists: from 5.9 on."""
    return version >= (5, 9)


def has_freedrive(version: Version) -> bool:
    """Return whether freedrive can be switched on by the script with chosen axes: from 5.10 on."""
    return version >= (5, 10)
