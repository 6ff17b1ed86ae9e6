"""Observations of fingers that press on an object, made up."""

import numpy as np

from palpate.runtime.data import ArmSample, FingerObservation, Observation
from palpate.sensing.contact import Contact, ContactStatus
from palpate.sensing.ft.health import HEALTHY, HealthCheck, SampleHealth
from palpate.spatial import IDENTITY, ZERO

BROKEN = SampleHealth(HealthCheck.FROZEN)


def finger(tangential=0.0, torque=0.0, normal=3.0, *, touching=True, health=HEALTHY, time=0.0):
    """A finger that presses along x of its sensor, with the load along y."""
    contact = Contact(
        centroid=np.zeros(3),
        normal=np.array([1.0, 0.0, 0.0]),
        force=np.array([-normal, tangential, 0.0]),
        normal_force=normal,
        tangential_force=np.array([0.0, tangential, 0.0]),
        spin_torque=torque,
        condition=1.0,
        status=ContactStatus.OK if touching else ContactStatus.NO_FORCE,
    )
    return FingerObservation(time, (-normal, tangential, 0.0, torque, 0.0, 0.0), contact, touching, health)


def observed(time, *fingers):
    """An arm at rest at the origin, and these fingers."""
    return Observation(time, ArmSample(time, ZERO, IDENTITY, ZERO), fingers)


def grip_load(grip, load, periods, first=0, period=1e-3, normal=None):
    """Step a grip while two fingers feel a load (tangential force, spin torque); return (commands, targets).

    Args:
        grip: Grip controller.
        load: Function of time [s] to (tangential force [N], spin torque [N m]) of each finger.
        periods: Number of periods.
        first: Index of the first period.
        period: Length of a period [s].
        normal: Function of time to the normal force [N]; without it the fingers feel the target.
    """
    commands, targets = [], []
    for i in range(first, first + periods):
        one = finger(*load(i * period), grip.target if normal is None else normal(i * period))
        grip.live.step(i * period)  # as the loop does
        commands.append(grip.step(observed(i * period, one, one)))
        targets.append(grip.target)
    return commands, np.array(targets)
