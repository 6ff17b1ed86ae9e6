"""A slip detector that knows the surface: a load near it slips."""

from palpate.friction.slip.kinds import kind_of_slip

NEAR = 0.95


class RatioDetector:
    """Tells slip as long as the load ratio is `NEAR` 1 or above."""

    def __init__(self, surface):
        self._surface = surface
        self._kind = None

    def step(self, load):
        ratio = self._surface.load_ratio(load.normal_force, load.tangential_length, load.spin_torque)
        if ratio == ratio:  # NaN says nothing
            self._kind = kind_of_slip(self._surface, load) if ratio >= NEAR else None
        return self._kind
