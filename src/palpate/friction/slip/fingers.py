"""Slip and friction of a whole hand: one detector per finger, one belief for all."""

import math
from collections.abc import Callable, Sequence
from typing import Protocol

from palpate.errors import InvalidValueError, positive
from palpate.friction.contact_load import ContactLoad
from palpate.friction.limit_surface import LimitSurface
from palpate.friction.slip.belief import FrictionBelief
from palpate.friction.slip.kinds import SlipKind
from palpate.spatial import ZERO, add, scale

NO_LOAD = ContactLoad(math.nan, (math.nan, math.nan, math.nan), math.nan)
"""Says nothing to any detector."""


class SlipDetector(Protocol):
    """Listens to one contact: `ExcitedSlip`."""

    def step(self, load: ContactLoad) -> SlipKind | None:
        """Take one sample; return the kind of slip as long as there is one."""
        ...


class FingerSlips:
    """Detects the onset of slip at each finger."""

    def __init__(self, build: Callable[[], SlipDetector]) -> None:
        """Take how a detector for one finger is made."""
        self._build = build
        self.start()

    kinds: tuple[SlipKind | None, ...]
    """What slips now, per finger."""

    @property
    def slipping(self) -> bool:
        """Whether a detected slip continues at any finger."""
        return any(kind is not None for kind in self.kinds)

    def start(self) -> None:
        """A new grip begins."""
        self._detectors: tuple[SlipDetector, ...] = ()
        self.kinds = ()

    def step(self, time: float, loads: Sequence[ContactLoad | None]) -> tuple[bool, ...]:
        """Return for each finger whether slip begins there in this period.

        Args:
            time: Of the period [s].
            loads: One per finger; None where there is none to be believed.
        """
        if len(self._detectors) != len(loads):
            self._detectors = tuple(self._build() for _ in loads)
            self.kinds = (None,) * len(loads)
        before = self.kinds
        self.kinds = tuple(
            detector.step(load or NO_LOAD) for detector, load in zip(self._detectors, loads, strict=True)
        )
        return tuple(now is not None and was is None for now, was in zip(self.kinds, before, strict=True))


class LearntSurface:
    """A belief about friction that all fingers of a hand feed, and its cautious surface to plan with.

    What was held counts as held when the next block of time has passed without slip: a slip is detected late, and
    the loads until then are no evidence of holding. Blocks are averaged, so that noise is not taken for strength.
    """

    def __init__(self, prior: Callable[[], FrictionBelief], caution: float = 0.02, block: float = 0.02) -> None:
        """Begin.

        Args:
            prior: Makes the belief that every grip begins with.
            caution: Probability that friction is less than the surface says.
            block: Over which loads are averaged [s]: longer than the detection of a slip takes.

        Raises:
            InvalidValueError: One of them cannot be.
        """
        if not 0.0 < caution <= 0.5:
            raise InvalidValueError(f"caution = {caution!r}: must be above 0 and at most 0.5, the best estimate")
        self._prior, self._caution = prior, caution
        self._block = positive("block", block, "s")
        self.start()

    def start(self) -> None:
        """A new grip begins: with what was believed at first."""
        self.belief = self._prior()
        self._surface: LimitSurface | None = None
        self._began = math.nan
        self._sums: list[tuple[int, ContactLoad]] = []
        self._full: list[ContactLoad | None] = []

    def surface(self, finger: int) -> LimitSurface:
        """Return what to plan with: the same for all fingers."""
        if self._surface is None:
            self._surface = self.belief.quantile(self._caution)
        return self._surface

    def watch(self, time: float, loads: Sequence[ContactLoad | None], onsets: Sequence[bool]) -> None:
        """Take what was felt in this period.

        Args:
            time: Of the period [s].
            loads: One per finger; None where there is none to be believed.
            onsets: One per finger: whether slip begins there.
        """
        if any(onsets):
            for load, onset in zip(loads, onsets, strict=True):
                if onset and load is not None:
                    self.belief.slipped(load)
                    self._surface = None
            self._forget()
            return
        if math.isnan(self._began) or len(self._sums) != len(loads) or None in loads:
            self._forget()
            self._began = time
            self._sums = [(0, ContactLoad(0.0, ZERO, 0.0)) for _ in loads]
        if None not in loads:
            self._sums = [
                (
                    n + 1,
                    ContactLoad(
                        s.normal_force + load.normal_force,
                        add(s.tangential_force, load.tangential_force),
                        s.spin_torque + load.spin_torque,
                    ),
                )
                for (n, s), load in zip(self._sums, loads, strict=True)
                if load is not None
            ]
        if time - self._began >= self._block:
            self._end_block(time)

    def _forget(self) -> None:
        """A block that slipped, and the one before it, are no evidence of holding."""
        self._began, self._sums, self._full = math.nan, [], []

    def _end_block(self, time: float) -> None:
        for held in self._full:
            if held is not None:
                self.belief.held(held)
                self._surface = None
        self._full = [
            ContactLoad(s.normal_force / n, scale(1.0 / n, s.tangential_force), s.spin_torque / n) if n else None
            for n, s in self._sums
        ]
        self._began = time
        self._sums = [(0, ContactLoad(0.0, ZERO, 0.0)) for _ in self._sums]
