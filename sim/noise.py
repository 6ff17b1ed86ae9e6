"""White noise of a force/torque sensor."""

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.errors import InvalidValueError, not_negative
from palpate.spatial import Wrench


@dataclass(frozen=True, slots=True)
class WrenchNoise:
    """Independent Gaussian noise per sample and axis.

    Attributes:
        force: Standard deviation of each force component [N].
        moment: Standard deviation of each moment component [N m].
        seed: The same seed gives the same noise.
    """

    force: float = 0.0
    moment: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        not_negative("force noise", self.force, "N")
        not_negative("moment noise", self.moment, "N m")
        if self.seed < 0:
            raise InvalidValueError(f"seed = {self.seed}: must be a whole number, 0 or above")


@dataclass(frozen=True, slots=True, eq=False)
class NoiseState:
    """Where a `NoiseSource` stands, opaque.

    Attributes:
        generator: State of its generator.
        drawn: What it has drawn ahead.
    """

    generator: Mapping[str, Any]
    drawn: tuple[tuple[float, ...], ...]


class NoiseSource:
    """Draws `WrenchNoise` in blocks: one call of the generator per thousand samples."""

    def __init__(self, noise: WrenchNoise) -> None:
        """Start the generator from the noise's seed."""
        self._generator = np.random.default_rng(noise.seed)
        self._scale = np.array([noise.force] * 3 + [noise.moment] * 3)
        self._silent = not self._scale.any()
        self._drawn: list[list[float]] = []

    def snapshot(self) -> "NoiseState":
        """Return where it stands."""
        return NoiseState(deepcopy(self._generator.bit_generator.state), tuple(map(tuple, self._drawn)))

    def restore(self, state: "NoiseState") -> None:
        """Go on from what `snapshot` returned."""
        self._generator.bit_generator.state = deepcopy(state.generator)
        self._drawn = [list(row) for row in state.drawn]

    def add_to(self, wrench: Wrench) -> Wrench:
        """Return the wrench with fresh noise added."""
        if self._silent:
            return wrench
        if not self._drawn:
            self._drawn = (self._generator.standard_normal((1000, 6)) * self._scale).tolist()
        a, b, c, d, e, f = self._drawn.pop()
        x, y, z, u, v, w = wrench
        return (x + a, y + b, z + c, u + d, v + e, w + f)
