"""What somebody may have meant who wrote a name that is not known."""

import difflib
from collections.abc import Sequence

UNITS = (
    "N_Nm_per_raw_unit",
    "raw_unit",
    "rad_per_s2",
    "rad_per_s",
    "m_per_s2",
    "m_per_s",
    "kg_m2",
    "N_per_m",
    "Nm",
    "W",
    "N",
    "kg",
    "rad",
    "m",
    "Hz",
    "s",
)
"""Unit suffixes of keys, longer ones first."""

# fmt: off
OTHER_UNITS = (
    "mm", "cm", "um", "in", "inch", "meter", "meters", "metre", "metres", "millimeters",
    "m_s", "mm_s", "mm_per_s", "cm_per_s", "mps", "m_s2", "mm_per_s2",
    "ms", "us", "min", "sec", "seconds", "kHz", "hertz",
    "mN", "kN", "lb", "lbf", "newton", "newtons", "mNm", "Nmm", "N_m", "N_mm", "lbin", "g", "gram", "grams",
    "deg", "degrees", "radians", "deg_s", "deg_per_s", "rpm",
)
# fmt: on
"""Endings that no key of ours has but people write."""

_ALL_UNITS = sorted({*UNITS, *OTHER_UNITS}, key=len, reverse=True)


def nearest(name: str, known: Sequence[str]) -> str | None:
    """Return the known name that is most like another, if any is."""
    by_case = {other.casefold(): other for other in known}
    if name.casefold() in by_case:
        return by_case[name.casefold()]
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
    return near[0] if near else None


def advice_on_key(key: str, known: Sequence[str]) -> str:
    """Return what to write instead of a key that is not known."""
    stem = without_unit(key)
    for other in known:
        if without_unit(other).casefold() == stem.casefold() and other != key:
            return f"unknown key; {_about_unit(key, other)}"
    near = nearest(key, known) or nearest(stem, [without_unit(other) for other in known])
    if near is not None:
        near = next(other for other in known if near in (other, without_unit(other)))
        return f"unknown key; did you mean {near}?"
    return f"unknown key; known are {', '.join(known)}"


def _about_unit(key: str, other: str) -> str:
    unit = other[len(without_unit(other)) + 1 :]
    if unit and key.endswith(f"_{unit}"):
        return f"did you mean {other}?"
    if unit:
        return f"the unit stands in the key: write {other}, in {unit_of(other)}"
    if without_unit(key) != key:
        return f"write {other}, in SI units (m, N, kg, s, rad); keys of this file carry no unit"
    return f"did you mean {other}?"


def without_unit(key: str) -> str:
    """Return a key without the unit at its end."""
    for unit in _ALL_UNITS:
        if key.endswith(f"_{unit}"):
            return key[: -len(unit) - 1]
    return key


def unit_of(key: str) -> str:
    """Return the unit at the end of a key as people write it: m/s^2; empty if it has none."""
    unit = key[len(without_unit(key)) + 1 :]
    return unit.replace("_per_", "/").replace("s2", "s^2").replace("m2", "m^2").replace("_", " ")
