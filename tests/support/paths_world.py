"""A tip that follows legs on shapes known in closed form: no dynamics, no force, contacts as geometry says."""

import math

import numpy as np
from scipy.optimize import brentq

from palpate.controllers.paths import Circuit, ContactPeriod, Hop, LegEnd, LegResult, SingleTouch, Stroke
from palpate.spatial import add_scaled, dot, unit

STEP = 2e-4


class HeightWorld:
    """The tip's origin moves on a surface h(u, v) seen from above; the tip is a point."""

    def __init__(self, height, steep=np.inf, lost=None, missing=None):
        self.height, self.steep = height, steep
        self.lost = lost or (lambda u, v: False)
        self.missing = missing or (lambda u, v: False)
        self.at = None
        self.legs = []

    def felt(self, u, v):
        d = 1e-7
        hu = (self.height(u + d, v) - self.height(u - d, v)) / (2 * d)
        hv = (self.height(u, v + d) - self.height(u, v - d)) / (2 * d)
        s = 1.0 / math.sqrt(1 + hu * hu + hv * hv)
        point = (u, v, self.height(u, v))
        return ContactPeriod(point, point, (-hu * s, -hv * s, s))

    def ended(self, how):
        return LegResult(how, (*self.at, 0.0))

    def do(self, leg, strategy):
        self.legs.append(leg)
        if isinstance(leg, Hop | SingleTouch):
            self.at = leg.to if isinstance(leg, Hop) else leg.at
            if self.missing(*self.at):
                return self.ended(LegEnd.MISSED)
            if isinstance(leg, SingleTouch):  # a landing is not swept
                strategy.feel(self.felt(*self.at))
            return self.ended(LegEnd.REACHED)
        assert isinstance(leg, Stroke)
        for corner in leg.corners:
            steps = max(int(math.dist(self.at, corner) / STEP), 1) + 1
            for at in np.linspace(self.at, corner, steps)[1:].tolist():
                self.at = tuple(at)
                if self.lost(*self.at):
                    return self.ended(LegEnd.LOST)
                felt = self.felt(*self.at)
                if math.acos(felt.normal[2]) > self.steep:
                    return self.ended(LegEnd.STEEP)
                strategy.feel(felt)
        return self.ended(LegEnd.REACHED)


def explore(strategy, world, most=2000):
    """Run a strategy to its end; return its legs."""
    strategy.start()
    leg = strategy.next(None)
    for _ in range(most):
        if leg is None:
            return world.legs
        leg = strategy.next(world.do(leg, strategy))
    raise AssertionError(f"no end after {most} legs")


class LevelSet:
    """Where {value <= 0} is solid, given by its signed distance: the tip's origin keeps `radius` from it."""

    def __init__(self, distance, radius):
        self.distance, self.radius = distance, radius

    def normal(self, p):
        steps = 1e-7 * np.eye(3)
        return unit(tuple(self.distance(tuple(p + s)) - self.distance(tuple(p - s)) for s in steps))

    def land(self, point):
        """The tip's origin where it first touches, coming from above."""

        def gap(z):
            return self.distance((*point, z)) - self.radius

        touching = next((z for z in np.linspace(0.1, -0.1, 4001) if gap(z) <= 0.0), None)
        return None if touching is None else (*point, brentq(gap, touching, touching + 6e-5, xtol=1e-15))

    def felt(self, p):
        n = self.normal(p)
        return ContactPeriod(p, add_scaled(p, -self.distance(p), n), n)

    def slide(self, p, direction, step=STEP):
        """Move along the surface, and back onto it as force control would."""
        p = add_scaled(p, step, direction)
        for _ in range(3):
            p = add_scaled(p, self.radius - self.distance(p), self.normal(p))
        return p


def circle_round(strategy, world):
    """Run a contour to its end; return the tip's way on the circuit."""
    strategy.start()
    leg, path, p = strategy.next(None), [], None
    while leg is not None:
        if isinstance(leg, Hop):
            p = world.land(leg.to)
            how = LegEnd.MISSED if p is None else LegEnd.REACHED
        else:
            assert isinstance(leg, Circuit)
            how, begun = LegEnd.OVERLONG, len(path)
            while how is LegEnd.OVERLONG and STEP * (len(path) - begun) < leg.longest:
                felt = world.felt(p)
                ended, direction = strategy.feel(felt), leg.steering.direction(felt)
                if ended or direction is None:
                    how = LegEnd.REACHED if ended else LegEnd.BLOCKED
                else:
                    assert abs(dot(direction, felt.normal)) < 1e-6
                    p = world.slide(p, direction)
                    path.append(p)
        leg = strategy.next(LegResult(how, p or (0.0, 0.0, 0.0)))
    return np.array(path)
