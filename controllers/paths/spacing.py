"""How far apart the lines of a path may be."""

from palpate.errors import InvalidValueError

IN_METRES = 1.0
"""[m] So far apart nobody has rows: it is in millimetres."""


def check_spacing(path: str, spacing: float, extent_name: str, extent: float) -> None:
    """Refuse lines that are farther apart than the path is large.

    Args:
        path: Its name.
        spacing: Of its lines [m].
        extent_name: Of what it must not exceed, as depth.
        extent: That [m].

    Raises:
        InvalidValueError: They are.
    """
    if spacing > extent:
        hint = f"; for {spacing:g} mm give {spacing / 1e3:g}" if spacing >= IN_METRES else ""
        raise InvalidValueError(
            f"{path} spacing = {spacing:g} m: must not exceed the {extent_name} = {extent:g} m{hint}"
        )
