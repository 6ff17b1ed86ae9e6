"""An exploration with all that can be asked of it, on simulated stages: moving, turning, misjudged."""

import math

import numpy as np
import pytest

from palpate.controllers import (
    Admittance,
    ExploreController,
    ExploreParameters,
    NormalAxis,
    Orientation,
    Raster,
    SineForce,
    VirtualBody,
    force_gain,
    series_stiffness,
    surface_filter,
    tracking_delay,
)
from palpate.controllers.paths import Follow
from palpate.runtime import Ending, Finger, Limits, Phase, Supervisor, Touch, run
from palpate.runtime.live import Change, ScheduledChanges
from palpate.runtime.replay import replay
from palpate.sensing.compensation import SensorPayload
from palpate.sim import (
    Box,
    ContactLaw,
    MujocoBackend,
    SphereObject,
    Stage,
    Tip,
    TurningStage,
    build_scene,
    white_noise,
)
from palpate.sim.objects.motion import DrivenJoint, JointKind, MovingTarget, Ramp, Sine
from palpate.surfaces import Sphere

PERIOD, FORCE, RADIUS = 1e-3, 2.0, 0.008

RASTER = Raster(0.02, 0.008, 0.008)

PLATE = Box((0.2, 0.2, 0.04))

RATE = 2.0  # of the sine [rad/s]: 10 mm, 20 mm/s

SHAKEN = MovingTarget(
    PLATE,
    [DrivenJoint(JointKind.SLIDE, (0.0, 0.0, 1.0), Sine(0.01, RATE / (2.0 * math.pi), math.pi / 2.0))],
    (0.0, 0.0, -0.01),
)

TURNTABLE = MovingTarget(PLATE, [DrivenJoint(JointKind.HINGE, (0.0, 0.0, 1.0), Ramp(1.0))])


class Swept:
    """One exploration of a target, done unless `done` is false; in contact whenever it sweeps.

    `make` and `changes` give pieces of the controller and changes of its live values for its gain.
    """

    def __init__(
        self, target, carrier=None, assumed=None, follow=False, seconds=8.0, make=lambda gain: {}, landing=0.005,
        done=True, raster=RASTER, noise=True, changes=lambda gain: (), **options,
    ):  # fmt: skip
        law, tip, carrier = ContactLaw(), Tip(Sphere(RADIUS)), carrier or Stage()
        start = (*raster.corners()[0], getattr(target, "shape", target).top + RADIUS + 0.001)
        sensor = white_noise(3.1e-3, 1.6e-5, 1) if noise else None
        backend = MujocoBackend(build_scene(tip, target, law, start, carrier), PERIOD, sensor)
        stiffness, delay = assumed or law.stiffness, tracking_delay(PERIOD, carrier.lag)
        gain = force_gain(series_stiffness(stiffness, carrier.stiffness(tip.mass)), delay)
        parameters = ExploreParameters(
            force=FORCE, speed=0.02, gain=gain, lead=delay, settle_time=0.8, landing_speed=landing
        )
        self.touch = Touch(Finger(Sphere(RADIUS - FORCE / (2.0 * law.stiffness)), SensorPayload(tip.mass)))
        track = surface_filter(stiffness, gain, delay) if follow else None
        self.make = lambda: ExploreController(
            parameters, Follow(raster), PERIOD, follow=track, **options, **make(gain)
        )
        rows, controller = [], self.make()
        result = run(
            backend,
            self.touch,
            controller,
            Supervisor(Limits(force=60.0)),
            duration=seconds,
            live=ScheduledChanges(controller.live, changes(gain)),
            observers=(lambda *row: rows.append((*row, backend.truth().touching, backend.truth().force)),),
        )
        self.samples, now, self.commands, touching, force = zip(*rows, strict=True)
        self.time, self.force = np.array([sample.time for sample in self.samples]), np.array(force)
        self.normal_force = np.array([each.fingers[0].contact.normal_force for each in now])
        self.scan = np.array([command.phase is Phase.SCAN for command in self.commands])
        assert not done or result.ending is Ending.DONE
        assert np.array(touching)[self.scan].all()

    def rms(self, wanted=FORCE):
        return float(np.sqrt(np.mean((self.force[self.scan, 2] - wanted) ** 2)))


def admittance(gain):
    body = VirtualBody(0.005 / gain.gain, 1.0 / gain.gain, gain.stiffness, gain.delay)
    return {"law": Admittance(body, PERIOD)}


@pytest.mark.slow
def test_a_turning_surface_is_followed_and_an_admittance_sweeps_too():
    """Following a still surface costs nothing."""
    assert Swept(TURNTABLE, follow=True).rms() < 0.05
    assert Swept(PLATE, make=admittance).rms() < 0.05
    assert Swept(PLATE, follow=True).rms() < Swept(PLATE).rms() + 0.01


@pytest.mark.slow
@pytest.mark.parametrize("assumed", [20e3 / 3.0, 60e3])
def test_with_a_stiffness_wrong_by_three_it_stays_stable(assumed):
    """A moving surface is landed on slowly, near its turning point; nothing comes near the limit of 20 N."""
    still = Swept(PLATE, assumed=assumed, follow=True)
    assert np.abs(still.force[still.scan, 2] - FORCE).max() < 1.0
    moving = Swept(SHAKEN, assumed=assumed, follow=True, seconds=14.0, landing=0.0005)
    assert np.abs(moving.force[moving.scan, 2] - FORCE).max() < 0.5
    assert moving.force[:, 2].max() < 10.0


def test_a_force_that_swings_is_held():
    swept = Swept(PLATE, profile=SineForce(2.0, 0.8, 0.5))
    since = swept.time[swept.scan] - swept.time[swept.scan][0]
    assert swept.rms(2.0 + 0.8 * np.sin(2.0 * math.pi * 0.5 * since)) < 0.06


@pytest.mark.slow
def test_the_tip_turns_with_the_surface_and_its_path_stays():
    """Over a sphere, with the tip's axis kept normal: the tip's centre sweeps the same path as upright."""
    axis = NormalAxis((0.0, 0.0, -1.0), gain=8.0, fastest=1.0)
    swept = Swept(SphereObject(0.04), TurningStage(), orientation=Orientation(axis, PERIOD))
    position = np.array([sample.arm.position_base_tip for sample in swept.samples])[swept.scan]
    down = -np.array([sample.arm.rotation_base_tip for sample in swept.samples])[swept.scan][:, :, 2]
    normal = -position / np.linalg.norm(position, axis=1)[:, None]  # the sphere's centre is the origin
    angle = np.degrees(np.arccos(np.clip(np.sum(down * normal, axis=1), -1.0, 1.0)))
    assert np.degrees(np.arccos((-normal[:, 2]).min())) > 10.0  # upright it would be off by so much
    assert np.median(angle[500:]) < 5.0
    # turning into place after landing rolls the tip away from the first corner: the first row steers it back
    reach = np.abs(position[1000:, :2]).max(axis=0)
    force = np.sum(swept.force[swept.scan] * -normal, axis=1)
    assert reach == pytest.approx([0.01, 0.004], abs=0.5e-3)
    assert np.sqrt(np.mean((force - FORCE) ** 2)) < 0.05


@pytest.mark.slow
def test_a_surface_that_moves_at_20_mm_per_s_is_followed():
    assert Swept(SHAKEN, follow=True).rms() < 0.1


def test_a_replay_with_everything_on_is_the_same_bit_for_bit():
    swept = Swept(SHAKEN, follow=True, seconds=2.0, done=False)
    again = replay(swept.samples, PERIOD, swept.touch, swept.make())
    controlled = sum(command.phase is not Phase.STOP for command in swept.commands)
    assert tuple(again.commands)[:controlled] == swept.commands[:controlled]
    assert controlled > 1500


def test_live_changes_of_force_speed_and_gain_keep_contact_and_force_on_a_sphere():
    def changes(gain):
        strongest = Change(3.0, "force_gain", gain.live_range[1])
        return Change(1.5, "force", 4.0), Change(2.5, "speed", 0.03), strongest, Change(3.5, "force", 1.0)

    raster = Raster(0.02, 0.016, 0.004)
    swept = Swept(SphereObject(), seconds=20.0, raster=raster, noise=False, changes=changes)
    velocity = np.array([command.velocity_base_tip for command in swept.commands])
    for begin, end, low, high in ((0.8, 1.5, 2, 2), (1.5, 3.5, 2, 4), (3.5, 4.2, 1, 4), (4.2, 9.0, 1, 1)):
        held = swept.normal_force[swept.scan & (swept.time > begin) & (swept.time <= end)]
        assert 0.9 * low <= held.min() <= held.max() <= 1.05 * high
    assert np.linalg.norm(np.diff(velocity, axis=0), axis=1).max() <= 10.0 * PERIOD * (1 + 1e-9)
