"""The controller that strokes: pure, so that a log replays bit for bit."""

import numpy as np

from palpate.runtime import Command, Observation, Phase

DOWN = (0.0, 0.0, -0.004)  # until it touches [m/s]
UP = (0.0, 0.0, 0.02)  # in the end [m/s]
SETTLING, LIFTING = 0.5, 0.3  # [s]


class Strokes:
    """Lands, strokes to and fro along x with a larger force each time, and lifts off.

    Attributes:
        spans: Force [N], beginning and end [s] of each finished stroke.
    """

    def __init__(self, config, half: float, gain: float) -> None:
        """Take what to do, half of the stroke [m], and the velocity per force error [m/s/N]."""
        self._config, self._half, self._gain = config, half, gain
        self.spans: list[tuple[float, float, float]] = []

    def start(self, first: Observation) -> None:
        """See `Controller`."""
        self._since: float | None = None  # of the present stroke's settling
        self._begun = self._lifted = None

    def step(self, now: Observation) -> Command:
        """See `Controller`."""
        finger, stroke = now.fingers[0], len(self.spans)
        if stroke == self._config.strokes:
            self._lifted = now.time if self._lifted is None else self._lifted
            return Command(UP, Phase.LIFT) if now.time < self._lifted + LIFTING else Command(phase=Phase.DONE)
        if not finger.touching:
            return Command(DOWN, Phase.APPROACH)
        self._since = now.time if self._since is None else self._since
        normal = np.array(now.arm.rotation_base_tip) @ finger.contact.normal
        push = self._gain * (self._config.forces[stroke] - finger.contact.normal_force)
        if now.time < self._since + SETTLING:
            return Command(push * normal, Phase.SETTLE)
        self._begun = now.time if self._begun is None else self._begun
        sign = 1.0 if stroke % 2 == 0 else -1.0
        if sign * now.arm.position_base_tip[0] >= self._half:
            self.spans.append((self._config.forces[stroke], self._begun, now.time))
            self._since = self._begun = None
            return Command(push * normal, Phase.SETTLE)
        along = np.array([sign, 0.0, 0.0]) - sign * normal[0] * normal
        return Command(push * normal + self._config.speed * along / np.linalg.norm(along), Phase.SCAN)
