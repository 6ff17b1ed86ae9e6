"""A tip swept over objects that are not convex: the force is held, and what is felt lies on them."""

import numpy as np
import pytest

from palpate.controllers import (
    ExploreController,
    ExploreParameters,
    Raster,
    force_gain,
    series_stiffness,
    tracking_delay,
)
from palpate.controllers.paths import Follow
from palpate.runtime import Ending, Finger, Limits, Phase, Supervisor, Touch, run
from palpate.runtime.log import MemoryLog, Recorder
from palpate.sensing.compensation import SensorPayload
from palpate.sim import ContactLaw, MujocoBackend, Stage, Tip, build_scene
from palpate.sim.objects.heights import bumps
from palpate.sim.objects.torus import Torus
from palpate.surfaces import Sphere

PERIOD, FORCE, RADIUS = 1e-3, 2.0, 0.004
LAW, STAGE = ContactLaw(), Stage()


def explored(target, raster, speed):
    """Sweep at a set force; return the result, the record, and the true normal force while scanning."""
    tip = Tip(Sphere(RADIUS))
    start = (*raster.corners()[0], target.top + RADIUS + 0.001)
    backend = MujocoBackend(build_scene(tip, target, LAW, start, STAGE), PERIOD)
    delay = tracking_delay(PERIOD, STAGE.lag)
    gain = force_gain(series_stiffness(LAW.stiffness, STAGE.stiffness(tip.mass)), delay)
    parameters = ExploreParameters(force=FORCE, speed=speed, gain=gain, lead=delay)
    finger = Finger(Sphere(RADIUS - FORCE / (2 * LAW.stiffness)), SensorPayload(tip.mass))
    memory, truth = MemoryLog(), []
    result = run(
        backend,
        Touch(finger),
        ExploreController(parameters, Follow(raster), PERIOD),
        Supervisor(Limits().allowing(speed + 0.02)),
        duration=30.0,
        recorder=Recorder(memory),
        observers=(lambda *_: truth.append(backend.truth().force),),
    )
    record = memory.record()
    force = -np.sum(np.array(truth) * record.normal, axis=1)
    return result, record, force


@pytest.mark.slow
@pytest.mark.parametrize(
    ("target", "raster", "limit"),
    [
        (bumps(), Raster(0.04, 0.008, 0.008), 0.20),
        (Torus(0.03, 0.012), Raster(0.004, 0.02, 0.02, (0.03, 0.0)), 0.15),
    ],
    ids=["bumps", "torus"],
)
def test_the_force_is_held_on_what_is_not_convex(target, raster, limit):
    result, record, force = explored(target, raster, 0.02)
    assert result.ending is Ending.DONE
    scanning = record.phase == Phase.SCAN.value
    assert record.touching[scanning].all()
    assert np.sqrt(np.mean((force[scanning] - FORCE) ** 2)) < limit
    points = record.centroid[scanning] - record.normal[scanning] * record.normal_force[scanning, None] / (
        2 * LAW.stiffness
    )
    assert np.sqrt(np.mean(target.signed_distance(points) ** 2)) < 0.02e-3
