"""Strokes in closed form: any resistance over the travel, any pose of sensor and contact, noise if wanted."""

import math

import numpy as np

from palpate.friction.rubbing.sliding import FrictionBound, FrictionMeasured, measure_friction
from palpate.friction.rubbing.stroke import RubbingStroke, TwoWay
from palpate.friction.rubbing.twisting import SpinMeasured, measure_spin

RATE = 500.0


def rotation(rng):
    """A random one."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))


class Sensed:
    """A contact somewhere on a sensor of any pose; `resist` maps signed travel of the motion to a ratio."""

    def __init__(self, rng=None, noise=0.0, force=2.0, random_pose=True):
        self.rng = rng or np.random.default_rng(0)
        self.noise, self.force = noise, force
        self.frame = rotation(self.rng) if random_pose else np.eye(3)  # columns: along, across, normal
        self.rotation = rotation(self.rng) if random_pose else np.eye(3)
        self.arm = self.rng.uniform(-0.02, 0.02, 3) if random_pose else np.array([0.0, 0.0, 0.02])
        self.clock = 0.0

    @property
    def normal(self):
        return self.frame[:, 2]

    def stroke(self, slide, torque, speed=0.0, spin=0.0, duration=0.5, begin=0.0, force=None, aside=0.0):
        """One motion; `slide` and `torque` give f_t / f_n against the motion and torque / f_n, over the travel.

        `begin` is where it starts [m]; `aside` is a constant tangential force across the motion, over f_n.
        """
        t = np.arange(round((0.05 + duration) * RATE)) / RATE
        run = np.clip((t - 0.05) / 0.04, 0.0, 1.0)  # starts within 40 ms
        way = np.concatenate([[0.0], np.cumsum(run[:-1]) / RATE])
        sense = np.sign(speed or spin)
        s, n = way * abs(speed or spin), len(t)
        fn = np.full(n, self.force if force is None else force)
        along, across, normal = self.frame.T
        f = -fn[:, None] * normal - (sense * fn * slide(s))[:, None] * along + (fn * aside)[:, None] * across
        q = -(sense * fn * torque(s))[:, None] * normal
        m = np.cross(self.arm, f) + q
        wrench = np.hstack([f @ self.rotation, m @ self.rotation])
        wrench += self.noise * self.rng.normal(size=wrench.shape) * np.repeat([0.01, 1e-4], 3)
        self.clock += t[-1] + 1.0 / RATE
        velocity = np.outer(run * speed, along)
        turning = np.outer(run * spin, normal)
        origin = velocity - np.cross(turning, self.arm)
        return RubbingStroke(
            t + self.clock,
            wrench,
            np.broadcast_to(self.rotation, (n, 3, 3)),
            np.outer(begin + way * speed, along),
            origin,
            turning,
            np.broadcast_to(self.arm @ self.rotation, (n, 3)),
        )

    def two_way(self, slide, torque, speed=0.0, spin=0.0, duration=0.5, forces=(None, None), aside=0.0):
        there = self.stroke(slide, torque, speed, spin, duration, 0.0, forces[0], aside)
        end = float(there.position[-1] @ self.frame[:, 0])
        return TwoWay(there, self.stroke(slide, torque, -speed, -spin, duration, end, forces[1], aside))


def changed(stroke, **fields):
    """The same stroke with other fields."""
    return RubbingStroke(**({name: getattr(stroke, name) for name in RubbingStroke.__slots__} | fields))


def nothing(s):
    return np.zeros_like(s)


def slips(level, travel):
    """Elastic from -level (the reversal) to level within `travel`, then constant."""
    return lambda s: np.minimum(level, -level + 2.0 * level * s / travel)


def gives_way(level, travel, preload=0.0, hardening=0.0):
    """Elastic all the way: level per travel, from a preload on; a power 1 + hardening."""
    return lambda s: preload + level * (np.abs(s) / travel) ** (1.0 + hardening)


def sawtooth(low, high, travel):
    """Stick-slip: rises from low to high over each `travel`."""
    return lambda s: low + (high - low) * np.mod(s, travel) / travel


def elastic_pair(sensed, stiffness, rest, speed, duration=0.5):
    """There and back on something elastic: the force is stiffness (x - rest) of the place x, whatever the way."""
    there = sensed.stroke(lambda s: stiffness * (s - rest), nothing, speed, duration=duration)
    end = float(there.position[-1] @ sensed.frame[:, 0])
    back = sensed.stroke(lambda s: -stiffness * (end - s - rest), nothing, -speed, duration=duration, begin=end)
    return TwoWay(there, back)


def measured(*pairs, errors=None):
    """Friction of strokes that slip."""
    found = measure_friction(pairs, errors)
    assert isinstance(found, FrictionMeasured), found
    return found


def bounded(*pairs):
    """Bound of friction by strokes that do not slip."""
    found = measure_friction(pairs)
    assert isinstance(found, FrictionBound), found
    return found


def rubbed(sensed, mu=0.5, **options):
    """Friction of a stroke that slips at once."""
    return measured(sensed.two_way(slips(mu, 1e-4), nothing, 0.02, **options))


def spun(*pairs, known, **options):
    """Spin length of twists that slip."""
    found = measure_spin(pairs, known, **options)
    assert isinstance(found, SpinMeasured), found
    return found


def elastic_turns(sensed, stiffness, rest, spin, duration=0.5):
    """Likewise for twists."""
    there = sensed.stroke(nothing, lambda s: stiffness * (s - rest), spin=spin, duration=duration)
    end = (
        math.fsum(np.clip((np.arange(round((0.05 + duration) * RATE) - 1) / RATE - 0.05) / 0.04, 0, 1) / RATE)
        * spin
    )
    back = sensed.stroke(nothing, lambda s: -stiffness * (end - s - rest), spin=-spin, duration=duration)
    return TwoWay(there, back)
