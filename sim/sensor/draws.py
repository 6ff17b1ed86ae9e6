"""The random numbers of a simulated sensor, drawn in blocks."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.sim.sensor.kernel import DRAWS, LOSS_DRAW
from palpate.sim.sensor.model import SensorModel

BLOCK = 256
"""Samples per block: drawing one takes some 20 us, of which no period should have many."""

Position = tuple[dict[str, Any], ...]
"""Where the generators stand, in numpy's form."""


@dataclass(frozen=True, slots=True)
class DrawState:
    """Where the generators stood before the present block was drawn."""

    before: Position


class SensorDraws:
    """Numbers for noise, random walk and losses, each from a generator of its own.

    So that a stage more does not change what the others draw.

    Attributes:
        block: Shape (n, 13), see `palpate.sim.sensor.kernel`; the same array for good.
    """

    def __init__(self, model: SensorModel, seed: int) -> None:
        """Draw the first block.

        Raises:
            InvalidValueError: The seed is negative.
        """
        self._noise, self._walk = model.noise is not None, model.random_walk is not None
        self._loss = model.dropouts is not None
        self.needed = self._noise or self._walk or self._loss
        self.block: FloatArray = np.zeros((BLOCK if self.needed else 1, DRAWS))
        self.block[:, LOSS_DRAW] = 1.0
        self.restart(seed)

    def restart(self, seed: int) -> None:
        """Draw the first block of `seed`.

        Raises:
            InvalidValueError: It is negative.
        """
        if seed < 0:
            raise InvalidValueError(f"seed = {seed}: must be a whole number, 0 or above")
        self._generators = [np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(3)]
        self.draw()

    def draw(self) -> None:
        """Draw the next block."""
        self._before: Position = self._position()
        noise, walk, loss = self._generators
        if self._noise:
            self.block[:, :6] = noise.standard_normal((BLOCK, 6))
        if self._walk:
            self.block[:, 6:LOSS_DRAW] = walk.standard_normal((BLOCK, 6))
        if self._loss:
            # above 0, at most 1: its logarithm is taken
            self.block[:, LOSS_DRAW] = 1.0 - loss.random(BLOCK)

    def state(self) -> DrawState:
        """Return where the generators stand; which number of the block is next, the sensor knows."""
        return DrawState(self._before)

    def set_state(self, state: DrawState) -> None:
        """Go back to a state, and draw its block again."""
        for generator, position in zip(self._generators, state.before, strict=True):
            generator.bit_generator.state = position
        self.draw()

    def _position(self) -> Position:
        return tuple(dict(generator.bit_generator.state) for generator in self._generators)
