"""The simulated stage of a robot file, one that turns or not."""

from dataclasses import replace

import msgspec

from palpate.kinematics import FollowingErrorLimit
from palpate.robots.robot import Robot
from palpate.robots.simulated_kind import SimulatedKind, TipCarrier
from palpate.sim import Fidelity, Stage, TurningStage
from palpate.sim.carriers.carrier import CarriedMass
from palpate.sim.presets import EXPLORE
from palpate.spatial import Vector

STAGE_RANGES = (
    *SimulatedKind.RANGES,
    ("mass_kg", 1e-3, 1000.0, "kg"),
    ("bandwidth_rad_per_s", 0.1, 1e4, "rad/s"),
    ("following_error_m", 1e-6, 0.1, "m"),
)


class StageEntry(SimulatedKind, frozen=True, kw_only=True):
    """The simulated three-axis stage: see `palpate.sim.carriers.stage.Stage`.

    Attributes:
        mass: Moving mass without the tip [kg].
        bandwidth: Natural frequency of its servos [rad/s].
        following_error_limit: Largest distance of the servos' reference from the actual position [m].
        time_step: Of the simulation [s]; the control period is a whole number of them.
    """

    TURNS = False
    RANGES = STAGE_RANGES

    mass: float = msgspec.field(name="mass_kg")
    bandwidth: float = msgspec.field(name="bandwidth_rad_per_s")
    following_error_limit: float = msgspec.field(name="following_error_m")
    time_step: float = msgspec.field(name="time_step_s")

    def tip_carrier(self, robot: Robot, load: CarriedMass, start: Vector) -> TipCarrier:
        """See `SimulatedKind`."""
        stage = Stage(self.mass, self.bandwidth, self.following_error_limit)
        fidelity = replace(EXPLORE.fidelity, time_step=self.time_step)
        lag, stiffness = stage.lag, stage.stiffness(load.mass)
        return TipCarrier(stage, fidelity, lag, lag, stiffness, self.following_error_limit)


class TurningStageEntry(SimulatedKind, frozen=True, kw_only=True):
    """The simulated stage that also turns: see `palpate.sim.carriers.turning_stage.TurningStage`.

    Attributes:
        mass: Moving mass without the tip [kg].
        inertia: Of what turns, without the tip, about every axis [kg m^2].
        bandwidth: Natural frequency of its servos [rad/s].
        following_error_limit: Largest distance of the servos' reference from the actual position [m].
        angular_following_error: Likewise, of its orientation [rad].
        time_step: Of the simulation [s]; the control period is a whole number of them.
    """

    RANGES = (
        *STAGE_RANGES,
        ("angular_following_error_rad", 1e-5, 1.5, "rad"),
        ("inertia_kg_m2", 1e-6, 100.0, "kg m^2"),
    )

    mass: float = msgspec.field(name="mass_kg", default=5.0)
    inertia: float = msgspec.field(name="inertia_kg_m2", default=0.01)
    bandwidth: float = msgspec.field(name="bandwidth_rad_per_s", default=100.0)
    following_error_limit: float = msgspec.field(name="following_error_m", default=0.0025)
    angular_following_error: float = msgspec.field(name="angular_following_error_rad", default=0.06)

    def tip_carrier(self, robot: Robot, load: CarriedMass, start: Vector) -> TipCarrier:
        """See `SimulatedKind`."""
        following = FollowingErrorLimit(self.following_error_limit, self.angular_following_error)
        stage = TurningStage(self.mass, self.bandwidth, following, self.inertia)
        # implicitfast: the servo of its ball joint counts on damping that is implicit
        fidelity = Fidelity(self.time_step)
        lag, stiffness = stage.lag, stage.stiffness(load.mass)
        return TipCarrier(stage, fidelity, lag, lag, stiffness, self.following_error_limit)
