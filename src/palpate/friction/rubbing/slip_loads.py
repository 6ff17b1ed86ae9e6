"""From a motion there and back, sliding and spinning at once, to load and slip for a fit of the limit surface."""

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.friction.rubbing.sliding import LATE_SHARES, SEEN_RISE, SETTLING
from palpate.friction.rubbing.slip_load import SlipLoad
from palpate.friction.rubbing.slip_test import Resistance, slip_evidence
from palpate.friction.rubbing.stroke import MIN_SAMPLES, RubbingStroke, TwoWay, steady_part


def slip_load(pair: TwoWay, normal: FloatArray, spin_length: float, settling: float = SETTLING) -> SlipLoad | None:
    """Return the load in full slip, or None if the contact never slipped.

    Half the difference of there and back, in which the sensor's zero cancels.

    Args:
        pair: The second motion reverses speed and spin of the first.
        normal: Out of the finger into the object, base coordinates, shape (3,), as `measure_friction` tells it.
        spin_length: e, roughly [m]: speed or e spin, whichever is larger, tells when the motion is steady.
        settling: How long transients last, the sensor's filter and delay included [s].

    Raises:
        InvalidValueError: One is too short, or they do not reverse each other.
    """
    there, back = (_Slip(stroke, normal, spin_length, settling) for stroke in pair.both)
    if float(there.slip @ back.slip) > -0.8 * float(np.linalg.norm(there.slip) * np.linalg.norm(back.slip)):
        raise InvalidValueError(
            "the second motion does not reverse the first: must go and turn back along the same path"
        )
    evidence = slip_evidence([there.resistance, back.resistance])
    if not evidence.slipped:
        return None
    for left_out in LATE_SHARES:
        shortest = min(len(each.resistance.travel) for each in (there, back))
        if evidence.rise <= SEEN_RISE * evidence.uncertainty or (1.0 - left_out) * shortest < MIN_SAMPLES:
            break
        # the beginning, where it did not slip yet
        there, back = (_Slip(stroke, normal, spin_length, settling, left_out) for stroke in pair.both)
        evidence = slip_evidence([there.resistance, back.resistance])
    slip = 0.5 * (there.slip - back.slip)
    load = 0.5 * (there.load - back.load)
    normal_force = 0.5 * (there.normal_force + back.normal_force)
    return SlipLoad(
        normal_force,
        float(np.linalg.norm(load[:3])) * normal_force,
        abs(float(load[3])) * normal_force,
        float(np.linalg.norm(slip[:3])),
        abs(float(slip[3])) / spin_length,
    )


class _Slip:
    """The steady part of one motion, but for a share of its beginning.

    Slip is (velocity, e spin), load is over normal force, shape (4,) each.
    """

    def __init__(
        self, stroke: RubbingStroke, normal: FloatArray, spin_length: float, settling: float, left_out: float = 0.0
    ) -> None:
        velocity = stroke.contact_velocity
        velocity = velocity - np.outer(velocity @ normal, normal)
        spin = stroke.angular_velocity @ normal
        slips = np.column_stack([velocity, spin_length * spin])
        mean = slips.mean(axis=0)
        if not mean.any():
            raise InvalidValueError("the finger does not move in this stroke: must be a motion in one direction")
        direction = mean / np.linalg.norm(mean)
        part = steady_part(stroke.time, slips @ direction, settling)
        part = slice(part.start + round(left_out * (part.stop - part.start)), part.stop)
        travel = np.concatenate([[0.0], np.cumsum((slips @ direction)[:-1] * np.diff(stroke.time))])
        force = stroke.force[part]
        pushing = -(force @ normal)
        torque = stroke.spin_torque(normal)[part]
        loads = np.column_stack([force + np.outer(pushing, normal), torque]) / pushing[:, None]
        self.slip = slips[part].mean(axis=0)
        self.load = loads.mean(axis=0)
        self.normal_force = float(pushing.mean())
        # against the motion, both on the scale of a force
        scale = np.array([1.0, 1.0, 1.0, 1.0 / spin_length])
        self.resistance = Resistance(travel[part], -(loads * scale) @ direction)
