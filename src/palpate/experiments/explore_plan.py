"""From a configuration to an exploration that can be carried out: everything is checked and built here."""

from dataclasses import dataclass

import numpy as np

from palpate.controllers import ExploreParameters, Raster, force_gain, series_stiffness, tracking_delay
from palpate.errors import InvalidValueError
from palpate.experiments.explore_config import LEAST_FORCE, MOST_FORCE, ExploreConfig
from palpate.experiments.robot_in_scene import build
from palpate.experiments.simulated_stage import Task
from palpate.runtime import FingerDescription, Limits
from palpate.runtime.robot import Robot, load_robot
from palpate.sim import (
    Box,
    ContactLaw,
    CylinderObject,
    EllipsoidObject,
    MujocoBackend,
    PairParameters,
    SceneObject,
    SphereObject,
    WrenchNoise,
)

CLEARANCE = 0.003
"""How far above the object's top the tip starts [m]."""

ROOM = 0.02
"""How far beyond its path the supervisor lets the tip go [m]."""


def scene_object(config: ExploreConfig) -> SceneObject:
    """Return the object that a configuration asks for."""
    size = config.size
    if config.object == "sphere":
        return SphereObject(size[0])
    if config.object == "ellipsoid":
        return EllipsoidObject((size[0], size[1], size[2]))
    if config.object == "box":
        return Box((size[0], size[1], size[2]))
    return CylinderObject(size[0], size[1])


def tip_surface(config: ExploreConfig, shrunk: float = 0.0) -> Sphere | Ellipsoid:
    """Return the fingertip's surface, moved inwards by `shrunk` [m]."""
    lengths = [length - shrunk for length in config.tip]
    if min(lengths) <= 0.0:
        raise InvalidValueError(
            f"tip = {min(config.tip):g} m: must be larger than its compression at {config.force:g} N and "
            f"{config.stiffness:g} N/m, {shrunk:.2g} m"
        )
    return Sphere(lengths[0]) if len(lengths) == 1 else Ellipsoid((lengths[0], lengths[1], lengths[2]))


def raster_over(target: SceneObject, config: ExploreConfig) -> Raster:
    """Return the raster over an object.

    Raises:
        InvalidValueError: It leaves the part of the object that can be touched from above.
    """
    raster = Raster(config.width, config.depth, config.spacing)

    def fits(factor: float) -> bool:
        return all(target.reachable(factor * x, factor * y, min(config.tip)) for x, y in raster.corners())

    if not fits(1.0):
        best = max((factor for factor in np.linspace(0.01, 0.99, 99).tolist() if fits(factor)), default=0.0)
        raise InvalidValueError(
            f"a raster of {config.width:g} x {config.depth:g} m leaves the part of the {config.object} that can "
            f"be touched from above; at most {best * config.width:.3g} x {best * config.depth:.3g} m in these "
            "proportions (--width, --depth), or take a larger object (--size)"
        )
    return raster


@dataclass(frozen=True, slots=True, eq=False)
class ExplorationPlan:
    """An exploration that can be carried out: everything checked and built, nothing moved yet.

    Attributes:
        config: What was asked for.
        target: What is touched.
        raster: The path of the tip's centre, from above.
        parameters: For the controller.
        finger: For touch.
        limits: For the supervisor.
        backend: The simulated stage.
        expected_duration: About how long it takes [s].
        half_compliance: Of tip and object together, half their compression per force [m/N].
    """

    config: ExploreConfig
    target: SceneObject
    raster: Raster
    parameters: ExploreParameters
    finger: Finger
    limits: Limits
    backend: MujocoBackend
    expected_duration: float
    half_compliance: float


def plan(config: ExploreConfig) -> ExplorationPlan:
    """Check and build everything that an exploration needs.

    Raises:
        InvalidValueError: The configuration cannot be realised; the message says what to change.
    """
    target = scene_object(config)
    raster = raster_over(target, config)
    half_compliance = 0.5 / config.stiffness
    shape, sensed = tip_surface(config), tip_surface(config, config.force * half_compliance)

    tip, stage = Tip(shape), Stage()
    law = ContactLaw(
        stiffness=config.stiffness,
        friction=config.friction,
        spin_length=config.spin_length,
        smallest_force=config.touch_force,
    )
    top = target.top + max(config.tip) + CLEARANCE
    first_x, first_y = raster.corners()[0]
    scene = build_stage_scene(tip, target, law, (first_x, first_y, top), stage)
    noise = WrenchNoise(config.force_noise, config.moment_noise, config.seed)
    _check_speed(config, scene.pair)

    payload = Payload(tip.mass, tip.center_of_mass)
    finger = Finger(sensed, payload, config.touch_force, config.touch_force / 2.0)
    delay = tracking_delay(config.period, stage.lag, finger.pipeline().delay)
    descent = 2.0 * target.top + max(config.tip) + CLEARANCE
    parameters = ExploreParameters(
        force=config.force,
        speed=config.speed,
        gain=force_gain(series_stiffness(config.stiffness, stage.stiffness(tip.mass)), delay),
        lead=delay,
        approach_distance=descent,
    )
    xs, ys = zip(*raster.corners(), strict=True)
    return ExplorationPlan(
        config,
        target,
        raster,
        parameters,
        finger,
        Limits(
            workspace_lower=(min(xs) - ROOM, min(ys) - ROOM, top - descent - ROOM),
            workspace_upper=(max(xs) + ROOM, max(ys) + ROOM, top + ROOM),
        ),
        MujocoBackend(scene, config.period, noise),
        _expected_duration(raster, parameters, top - float(target.height(np.array(first_x), np.array(first_y)))),
        half_compliance,
    )


def _check_speed(config: ExploreConfig, pair: PairParameters) -> None:
    """Refuse speeds at which the simulated friction is not Coulomb's, or the tip would lift off."""
    creep = pair.creep_speed * config.force / config.touch_force  # grows with the force
    if not creep < config.speed < pair.lift_speed / 2.0:
        raise InvalidValueError(
            f"speed = {config.speed:g} m/s: must lie between {creep:.2g} m/s, below which the simulated friction "
            f"creeps, and {pair.lift_speed / 2.0:.2g} m/s, from which it may lift the tip"
        )


def _expected_duration(raster: Raster, parameters: ExploreParameters, gap: float) -> float:
    """About how long it takes: the way down, the rows on a surface that climbs, a stop at every corner."""
    stop = parameters.speed / parameters.acceleration + 0.05
    way = 1.25 * raster.length / parameters.speed + len(raster.corners()) * stop
    return gap / parameters.landing_speed + parameters.settle_time + way
