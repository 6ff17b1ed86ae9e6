"""Text representation of surfaces."""

from dataclasses import fields

import numpy as np


class Shown:
    """A surface that prints what it was given, on one line; its frame only where it is not the sensor's own."""

    def __repr__(self) -> str:
        """Name and arguments."""
        given = {each.name: getattr(self, each.name) for each in fields(self) if each.init}  # type: ignore[arg-type]
        center, rotation = given.pop("center"), given.pop("rotation")
        if center.any():
            given["center"] = center.tolist()
        if (rotation != np.eye(3)).any():
            given["rotation"] = rotation.tolist()
        shown = ", ".join(f"{name}={_one_line(value)}" for name, value in given.items())
        return f"{type(self).__name__}({shown})"


def _one_line(value: object) -> str:
    if isinstance(value, np.ndarray):
        return repr(value.tolist())
    return getattr(value, "__name__", None) or repr(value)
