"""What a view shows of the world: parts made of triangles, the bodies they are fixed to, where those are."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError, positive
from palpate.kinematics import Pose
from palpate.kinematics.posture import Posture
from palpate.viewing.surface_view import SurfaceView

Colour = tuple[int, int, int]
"""RGB, 0 to 255."""

BASE = ""
"""The body that never moves."""

TIP = "tip"
"""The body of a single fingertip."""


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A rigid piece.

    Attributes:
        vertices: In the frame of its body, shape (n, 3) [m].
        triangles: Corners, shape (m, 3).
        colour: RGB.
        body: Name of the body that it is fixed to; `BASE` for the base frame.
        opacity: 1 for solid.
        is_ground: What it all stands on: pictures may cut it off.
    """

    vertices: FloatArray
    triangles: npt.NDArray[np.int64]
    colour: Colour
    body: str = BASE
    opacity: float = 1.0
    is_ground: bool = False


class Placement(Protocol):
    """Knows where a scene's bodies are. It can be handed to another process."""

    @property
    def start(self) -> Posture:
        """Where everything starts; its lengths are the numbers of joints and free bodies."""
        ...

    def poses(self, posture: Posture) -> Mapping[str, Pose]:
        """Return pose_base_body of every body that can move, by name.

        Raises:
            InvalidValueError: The posture has other joints or bodies.
        """
        ...


@dataclass(frozen=True, slots=True)
class TipPlacement:
    """Of a fingertip alone, whatever carries it. A `Placement`."""

    start: Posture = field(default_factory=Posture)

    def poses(self, posture: Posture) -> Mapping[str, Pose]:
        """See `Placement`."""
        return {TIP: posture.pose_base_tip}


@dataclass(frozen=True, slots=True, eq=False)
class ViewScene:
    """All that a view shows beside what is measured.

    Attributes:
        title: For people; may hold whatever they typed.
        parts: Solid things.
        placement: Where the bodies are.
        fingers: Name of the body whose frame is each finger's sensor frame.
        map_spacing: Distance below which points of the map are merged [m], which the first finger makes; None:
            there is no map.
        surface: How the map becomes a surface that grows; None for its contacts alone.
    """

    title: str
    parts: tuple[Part, ...]
    placement: Placement = field(default_factory=TipPlacement)
    fingers: tuple[str, ...] = (TIP,)
    map_spacing: float | None = 5e-4
    surface: SurfaceView | None = None

    def __post_init__(self) -> None:
        if self.map_spacing is not None:
            positive("map_spacing", self.map_spacing, "m")
        known = self.placement.poses(self.placement.start)
        for body in (*(part.body for part in self.parts if part.body != BASE), *self.fingers):
            if body not in known:
                raise InvalidValueError(
                    f"body = {body!r}: is none that moves in this scene; there are {', '.join(known)}"
                )
        if self.surface is not None and self.map_spacing is None:
            raise InvalidValueError("surface: there is none without a map; give map_spacing, or None for both")

    def corners(self, poses: Mapping[str, Pose]) -> FloatArray:
        """Return the vertices of all parts but the ground, base frame, shape (n, 3) [m]; a box if there are none.

        Args:
            poses: Of the bodies, from `placement`.
        """
        found = [_in_base(part, poses.get(part.body, Pose())) for part in self.parts if not part.is_ground]
        return np.concatenate(found) if found else np.array([[-0.1, -0.1, 0.0], [0.1, 0.1, 0.1]])


def _in_base(part: Part, pose: Pose) -> FloatArray:
    return np.asarray(part.vertices @ np.array(pose.rotation).T + np.array(pose.position))
