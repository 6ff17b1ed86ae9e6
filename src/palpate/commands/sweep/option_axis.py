"""A varied option as figures show it: where its values stand along an axis, and what they are called."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from palpate.commands.sweep.plan import DIGITS
from palpate.commands.typed_values import Varied, shown_value
from palpate.errors import FloatArray
from palpate.reporting.figure import Axis
from palpate.reporting.marks import shortened
from palpate.reporting.units import Scale, scale_of

LOGARITHMIC = 20.0
"""Ratio of the largest to the least value from which the axis is logarithmic."""

ROOM = 0.04
"""Beside the first and the last number, over the distance between them."""

LONGEST_NAME = 18
"""Letters of a value."""


@dataclass(frozen=True)
class OptionAxis:
    """An option with its values.

    Attributes:
        varied: The option.
        unit: In SI; "" if it has none.
    """

    varied: Varied
    unit: str

    @cached_property
    def numeric(self) -> bool:
        """Whether its values are numbers."""
        return all(isinstance(value, int | float) and not isinstance(value, bool) for value in self.varied.values)

    @cached_property
    def words(self) -> str:
        """Its name in words."""
        return self.varied.name.replace("_", " ")

    @cached_property
    def places(self) -> FloatArray:
        """Where its values stand, shape (n,): numbers where they are, in the unit of the axis, words in turn."""
        if not self.numeric:
            return np.arange(float(len(self.varied.values)))
        return np.array([self._scale.factor * float(value) for value in self.varied.values])  # type: ignore[arg-type]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Its values in the unit of the axis, each another text."""
        names = [self._text(value) for value in self.varied.values]
        return tuple(
            names if len(set(names)) == len(names) else (f"{i + 1}: {each}" for i, each in enumerate(names))
        )

    @cached_property
    def assignments(self) -> tuple[str, ...]:
        """The option with each of its values and their unit."""
        return tuple(f"{self.words} = {each} {self._scale.unit}".rstrip() for each in self.names)

    @cached_property
    def axis(self) -> Axis:
        """Along which its values stand."""
        if not self.numeric:
            ticks = tuple(zip(self.places.tolist(), self.names, strict=True))
            return Axis(self.words, low=-0.6, high=len(ticks) - 0.4, ticks=ticks)
        least, largest = float(self.places.min()), float(self.places.max())
        if least > 0.0 and largest >= LOGARITHMIC * least:
            room = (largest / least) ** ROOM
            return Axis(self.words, self._scale.unit, least / room, largest * room, logarithmic=True)
        room = ROOM * (largest - least)
        return Axis(self.words, self._scale.unit, least - room, largest + room)

    @cached_property
    def _scale(self) -> Scale:
        if not self.numeric:
            return Scale(1.0, self.unit)
        return scale_of(self.unit, max(abs(float(value)) for value in self.varied.values))  # type: ignore[arg-type]

    def _text(self, value: object) -> str:
        if isinstance(value, float) and self.numeric:
            return f"{self._scale.factor * value:.{DIGITS}g}"
        return shortened(shown_value(value).rsplit("/", 1)[-1], LONGEST_NAME)  # of a file, its name
