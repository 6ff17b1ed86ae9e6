"""The content of a scene's parts, so that a scene that was compiled before is known again.

Parts from a robot file or an experiment are made anew for every run, and many hold arrays: they are compared by
what they are made of, not by which object they are.
"""

import io
import pickle
import types
from typing import Any

import mujoco

from palpate.sim.carriers.arm_model import ArmModel

_ITSELF = (type, types.FunctionType, mujoco.MjSpec, ArmModel)
"""Compared by which object it is: code, which a notebook may define anew under the same name, and an arm, which is
read once."""


class SceneContent:
    """Parts of a scene that are equal if they are of the same kinds and hold the same numbers.

    Attributes:
        parts: As they were given.
    """

    __slots__ = ("_packed", "_themselves", "parts")

    def __init__(self, *parts: Any) -> None:
        """Take the parts.

        Raises:
            Exception: One of them cannot be pickled; each kind has its own way to say so.
        """
        self.parts, self._themselves = parts, list[object]()
        packed = io.BytesIO()
        _Packer(packed, self._themselves).dump(parts)
        self._packed = packed.getvalue()

    def __eq__(self, other: object) -> bool:
        """Whether the same scene comes of them."""
        return isinstance(other, SceneContent) and self._packed == other._packed

    def __hash__(self) -> int:
        """Of what is compared."""
        return hash(self._packed)


class _Packer(pickle.Pickler):
    """Packs what is compared by itself as its number, and keeps it, so that no other object gets that number."""

    def __init__(self, file: io.BytesIO, themselves: list[object]) -> None:
        super().__init__(file, pickle.HIGHEST_PROTOCOL)
        self._themselves = themselves

    def persistent_id(self, found: object) -> int | None:
        if not isinstance(found, _ITSELF):
            return None
        self._themselves.append(found)
        return id(found)
