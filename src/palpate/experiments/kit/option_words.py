"""Options of experiments as people read them in reports: yes or no, several numbers, and in which unit."""

from collections.abc import Mapping, Sequence

UNITS: Mapping[str, str] = {
    **dict.fromkeys(
        (
            "size", "tip", "width", "depth", "center", "spacing", "radius", "below", "accuracy", "spin_length",
            "surface_amplitude", "motion_size", "travel", "most_travel", "believed_spin_length", "offset",
            "lift_height",
        ),
        "m",
    ),
    **dict.fromkeys(("force", "force_swing", "force_noise", "swing", "loads", "pull", "pull_before"), "N"),
    **dict.fromkeys(
        ("force_period", "time", "period", "leave_time", "hold", "duration", "assumed_damping_time", "rise"), "s"
    ),
    **dict.fromkeys(
        ("speed", "speeds", "surface_speed", "motion_speed", "landing_speed", "stribeck_speed", "lift_speed"),
        "m/s",
    ),
    **dict.fromkeys(("stiffness", "mount_stiffness", "assumed_stiffness", "skin_stiffness"), "N/m"),
    **dict.fromkeys(("frequencies", "shake_frequency"), "Hz"),
    **dict.fromkeys(("mount_mass", "mass"), "kg"),
    "moment_noise": "N m",
    "rate": "N/s",
    "drift": "N/min",
    "viscous_friction": "s/m",
}  # fmt: skip
"""Of options, as their help says."""

OTHER_UNITS: Mapping[tuple[str, str], str] = {("grasp", "drift"): "N/s"}
"""By experiment and option, where it differs from those."""


def option_unit(experiment: str, name: str) -> str:
    """Return the unit of an option of `palpate EXPERIMENT`; empty if it has none."""
    return OTHER_UNITS.get((experiment, name), UNITS.get(name, ""))


def option_words(value: object) -> str:
    """Return a value of an option without its unit."""
    if _is_left_out(value):
        return "left out"
    if isinstance(value, bool):
        return "yes" if value else "no"
    each = value if isinstance(value, Sequence) and not isinstance(value, str) else (value,)
    return " x ".join(f"{one:g}" if isinstance(one, float) else str(one) for one in each)


def has_unit(value: object) -> bool:
    """Return whether a value of an option is one or several numbers, which may have a unit."""
    return not (_is_left_out(value) or isinstance(value, str | bool))


def _is_left_out(value: object) -> bool:
    return value is None or value == ()
