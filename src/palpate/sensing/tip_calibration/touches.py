"""Touches at rest: what was felt, and where the sensor was."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError


@dataclass(frozen=True, slots=True, eq=False)
class Touches:
    """n touches, as a structure of arrays; several forces of one touch are several rows.

    Attributes:
        target: Which target, shape (n,).
        wrench: What it exerts on the tip, sensor frame, the reading in the air just before taken off, shape (n, 6)
            [N, N m].
        wrench_sd: Standard deviation of that, noise alone, shape (n, 6).
        rotation: Of the sensor frame in the base frame, shape (n, 3, 3).
        position: Likewise, measured while touching, shape (n, 3) [m].
        time: Shape (n,) [s].
    """

    target: npt.NDArray[np.intp]
    wrench: FloatArray
    wrench_sd: FloatArray
    rotation: FloatArray
    position: FloatArray
    time: FloatArray

    def __post_init__(self) -> None:
        n = len(self.target)
        for name, shape in (
            ("wrench", (n, 6)),
            ("wrench_sd", (n, 6)),
            ("rotation", (n, 3, 3)),
            ("position", (n, 3)),
            ("time", (n,)),
        ):
            value = np.asarray(getattr(self, name), dtype=float)
            if value.shape != shape:
                raise InvalidValueError(f"{name} has shape {value.shape}: must be {shape} for {n} touches")
            bad = ~np.isfinite(value).all(axis=tuple(range(1, value.ndim)))
            if bad.any():
                raise InvalidValueError(f"{name} of touch {int(np.argmax(bad))} is not finite")
            object.__setattr__(self, name, value)
        object.__setattr__(self, "target", np.asarray(self.target, dtype=np.intp))
        off = np.abs(self.rotation @ self.rotation.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2), initial=0.0)
        mirrored = np.linalg.det(self.rotation) < 0.0
        if n and (off.max() > 1e-6 or mirrored.any()):
            worst = int(np.argmax(np.where(mirrored, np.inf, off)))
            raise InvalidValueError(f"rotation of touch {worst} is no rotation: {self.rotation[worst].tolist()}")
        if not (self.wrench_sd > 0.0).all():
            raise InvalidValueError("wrench_sd must be above 0: noise of the mean reading")

    def __len__(self) -> int:
        """Number of touches."""
        return len(self.target)

    def selected(self, rows: npt.ArrayLike) -> "Touches":
        """Return some of them: indices or a mask."""
        r = np.asarray(rows)
        return Touches(
            self.target[r], self.wrench[r], self.wrench_sd[r], self.rotation[r], self.position[r], self.time[r]
        )
