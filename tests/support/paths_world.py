"""A tip that follows legs on shapes known in closed form: no dynamics, no force, contacts as geometry says."""

import math

import numpy as np

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
            a, b = np.array(self.at), np.array(corner)
            for t in np.linspace(0.0, 1.0, max(int(np.linalg.norm(b - a) / STEP), 1) + 1)[1:]:
                self.at = tuple((a + t * (b - a)).tolist())
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
        d = 1e-7
        gradient = []
        for k in range(3):
            e = [0.0, 0.0, 0.0]
            e[k] = d
            plus = self.distance(tuple(a + b for a, b in zip(p, e, strict=False)))
            minus = self.distance(tuple(a - b for a, b in zip(p, e, strict=False)))
            gradient.append((plus - minus) / (2 * d))
        return unit(tuple(gradient))

    def land(self, point):
        """The tip's origin where it first touches, coming from above."""
        low, high = -0.1, 0.1
        for z in np.linspace(high, low, 4001):
            if self.distance((*point, z)) <= self.radius:
                high, low = z + 5e-5, z
                break
        else:
            return None
        for _ in range(50):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.distance((*point, middle)) <= self.radius else (low, middle)
        return (*point, 0.5 * (low + high))

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
            how, gone = LegEnd.OVERLONG, 0.0
            while gone < leg.longest:
                felt = world.felt(p)
                if strategy.feel(felt):
                    how = LegEnd.REACHED
                    break
                direction = leg.steering.direction(felt)
                if direction is None:
                    how = LegEnd.BLOCKED
                    break
                assert abs(dot(direction, felt.normal)) < 1e-6
                p = world.slide(p, direction)
                path.append(p)
                gone += STEP
        leg = strategy.next(LegResult(how, p or (0.0, 0.0, 0.0)))
    return np.array(path)
