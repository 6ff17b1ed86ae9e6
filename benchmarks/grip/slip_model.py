"""A held object with two degrees of freedom between two fingers: for thousands of slips in seconds.

The object slides along z and turns about the grip axis; each fingertip holds it by the friction plant's own
bristle and limit surface (`palpate.sim.friction.bristle`). The grip is given, not simulated. How far an object
slips once it does is not to be taken from here: nothing catches it. When it begins to is.
"""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from palpate.errors import FloatArray
from palpate.sim.friction.bristle import DAMPING, SPIN_LENGTH, STIFFNESS, borne, packed
from palpate.sim.friction.law import FrictionLaw

TIME_STEP = 1e-4
PERIOD = 1e-3
STEPS = round(PERIOD / TIME_STEP)
ONSET = 1e-6
"""Slip [m] that counts as one: a two-hundredth of what the fingertip's bristle gives way."""


@dataclass(frozen=True, slots=True, eq=False)
class Held:
    """What happened, per control period and finger; loads are true ones, shape (n, 2).

    Attributes:
        normal_force: [N].
        force: Along z [N].
        torque: [N m].
        slid: Slip along z so far [m].
        spun: e times the turn of the slip so far [m].
        onset: When a finger first had slipped by ONSET [s]; infinite if never.
        spin_share: e omega / |(v, e omega)| of the slip when the first of them had slipped by 10 ONSET.
    """

    normal_force: FloatArray
    force: FloatArray
    torque: FloatArray
    slid: FloatArray
    spun: FloatArray
    onset: float
    spin_share: float


@njit(cache=True, error_model="numpy")
def _run(
    mass: float,
    inertia: float,
    pull: FloatArray,
    twist: FloatArray,
    grip: FloatArray,
    laws: FloatArray,
    dt: float,
    every: int,
) -> FloatArray:
    """Rows of (f_n, f, tau, slid, spun) x 2; loads in steps of dt, a row every `every` steps."""
    n = len(pull) // every
    rows = np.zeros((n, 10))
    stretch, turned, slid, spun = np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2)
    v, w = 0.0, 0.0
    for k in range(n * every):
        force, torque = pull[k], twist[k]
        for i in range(2):
            law = laws[i]
            radius = law[SPIN_LENGTH]
            viscous = law[DAMPING] / dt
            stiff = law[STIFFNESS] + viscous
            trial = law[STIFFNESS] * stretch[i] + stiff * v * dt
            trial_torque = radius**2 * (law[STIFFNESS] * turned[i] + stiff * w * dt)
            f, q, _ = borne(abs(trial), abs(trial_torque), grip[k, i], stiff * dt, law, 1.0)
            f, q = math.copysign(f, trial), math.copysign(q, trial_torque)
            slid[i] += abs(trial - f) / stiff
            spun[i] += abs(trial_torque - q) / (stiff * radius)
            stretch[i] = (f + viscous * stretch[i]) / stiff
            turned[i] = (q / radius**2 + viscous * turned[i]) / stiff
            force -= f
            torque -= q
            if (k + 1) % every == 0:
                row, at = (k + 1) // every - 1, 5 * i
                rows[row, at] = grip[k, i]
                rows[row, at + 1] = f
                rows[row, at + 2] = q
                rows[row, at + 3] = slid[i]
                rows[row, at + 4] = spun[i]
        v += dt * force / mass
        w += dt * torque / inertia
    return rows


def hold(
    mass: float,
    inertia: float,
    pull: FloatArray,
    twist: FloatArray,
    grip: FloatArray,
    laws: tuple[FrictionLaw, FrictionLaw],
) -> Held:
    """Simulate.

    Args:
        mass: [kg].
        inertia: About the grip axis [kg m^2].
        pull: On the object along z, every TIME_STEP, shape (n,) [N].
        twist: Likewise about the grip axis [N m].
        grip: Normal force of each finger, shape (n, 2) [N].
        laws: Of each finger.
    """
    rows = _run(
        mass,
        inertia,
        pull,
        twist,
        grip,
        np.array([packed(law, 2.0 * law.damping_ratio * math.sqrt(0.5 * mass * law.stiffness)) for law in laws]),
        TIME_STEP,
        STEPS,
    )
    both = rows.reshape(len(rows), 2, 5)
    slip = np.hypot(both[:, :, 3], both[:, :, 4]).max(axis=1)
    began = np.flatnonzero(slip > ONSET)
    share, onset = math.nan, math.inf
    if len(began):
        k = int(began[0])
        before = slip[k - 1] if k else 0.0
        onset = PERIOD * (k - 1 + (ONSET - before) / (slip[k] - before))
        later = np.flatnonzero(slip > 10.0 * ONSET)
        at = int(later[0]) if len(later) else len(slip) - 1
        i = int(np.hypot(both[at, :, 3], both[at, :, 4]).argmax())
        share = float(both[at, i, 4] / math.hypot(both[at, i, 3], both[at, i, 4]))
    normal_force, force, torque, slid, spun = (both[:, :, j] for j in range(5))
    return Held(normal_force, force, torque, slid, spun, onset, share)
