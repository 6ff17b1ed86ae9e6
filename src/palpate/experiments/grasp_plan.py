"""A grasp, planned: everything that a run, or its replay, needs."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from palpate.controllers.grip.belief import SurfaceBelief
from palpate.controllers.grip.grasp import Carry, GraspController, GraspStage, SetDownParameters
from palpate.controllers.grip.lift import LiftController, LiftParameters
from palpate.controllers.grip.need import GripNeed, NeedWithoutSpin, NeedWithSpin
from palpate.controllers.grip.noted_watch import NotedWatch, UnheededWatch
from palpate.controllers.grip.nudge import NudgeAndLift, NudgeController, NudgedSurface, NudgeParameters
from palpate.controllers.grip.parameters import GripParameters
from palpate.controllers.grip.rippled import RippledGrip
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.errors import InvalidValueError
from palpate.experiments.friction_file import friction_file_text, load_friction_file
from palpate.experiments.grasp_belief import RIPPLE, belief_of, believed_surface, slips_of
from palpate.experiments.grasp_config import GraspConfig
from palpate.experiments.grasp_scene import PullTimes, hand_of, load_of, pull_times, scene_of, sensor_of
from palpate.experiments.grasp_text import GRASP_TEXT, KNOWN_TEXT, grasp_text, read_grasp
from palpate.friction.limit_surface import LimitSurface
from palpate.runtime import Limits, Touch
from palpate.runtime.touch import Finger
from palpate.sensing.compensation import Payload
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.hand import Hand
from palpate.spatial import ZERO, Vector
from palpate.surfaces import Sphere

PERIOD = 1e-3
"""[s]: what the simulated hand's bus and the detectors of slip are made for."""

LIFT_ACCELERATION = 0.3
"""[m/s^2] Of lifting and lowering: 3 % of the weight."""

LOWERING_SPEED = 0.02
"""[m/s] From that it stops within a millisecond with 20 m/s^2, within the limits."""

NUDGING_GRIP = 2.0
"""[N] 2 mu e f_n is then less than tips over a box of 0.1 kg, with mu 0.65 and e 6 mm too: 16 of 24 mNm."""

NUDGING_SPIN = 0.24
"""[rad/s] The nudge's twist begins at once: 92 mm from the palm that is 22 m/s^2 within a millisecond, and
240 rad/s^2, just within the limits."""

CONTACT_TIME = 0.15
"""[s] From the first touch to all of them, and what servos and their bus take."""

SPARE = 0.3
"""[s] From when it should be held to when something pulls."""

LARGEST_GRIP = 17.0
"""[N] 12 mm before the sensor that is 0.20 N m, of the 0.25 it can measure; a grip that jumps there with 300 N/s
overshoots by an eighth."""

LIMITS = Limits(force=24.0, grip_force=24.0, moment=0.25)
"""As the sensors', and above the largest grip that is commanded."""

NOTHING: Mapping[str, str] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class GraspPlan:
    """A grasp, planned.

    Attributes:
        config: What was asked for.
        believed: What the contacts are believed to bear at first.
        times: When it is pulled.
        lift: How it is lifted.
        known: What rubbing had found, as text; empty if nothing was rubbed.
    """

    config: GraspConfig
    believed: LimitSurface
    times: PullTimes
    lift: LiftParameters
    known: str = ""

    @property
    def true(self) -> LimitSurface:
        """What the contacts really bear."""
        return LimitSurface(self.config.friction, self.config.spin_length)

    @property
    def limits(self) -> Limits:
        """For the supervisor."""
        return LIMITS

    @property
    def fingers(self) -> tuple[Finger, ...]:
        """For touch, one per finger."""
        tip = hand_of(self.config).tip
        return (Finger(tip.surface, Payload(tip.mass, tip.center_of_mass)),) * self.config.fingers

    @property
    def expected_duration(self) -> float:
        """How long it takes if nothing goes wrong [s]."""
        down = self.config.lift_height / LOWERING_SPEED + LOWERING_SPEED / LIFT_ACCELERATION
        return self.times.gone + down + 1.5

    def touch(self) -> Touch:
        """Return fresh touch."""
        return Touch(*self.fingers)

    def backend(self) -> HandBackend:
        """Return the simulated hand over the object.

        Raises:
            InvalidValueError: It cannot be simulated so.
        """
        config = self.config
        return HandBackend(scene_of(config), PERIOD, sensor=sensor_of(config), load=load_of(config, self.times))

    def watch(self) -> NotedWatch:
        """Return a fresh listener for slip; a grip that ignores spin does not listen to it."""
        slips = slips_of(self.config, self.believed, tip_radius(hand_of(self.config)), PERIOD)
        return UnheededWatch(slips) if self.config.ignore_spin else NotedWatch(slips)

    def controller(self, watch: NotedWatch | None = None) -> GraspController:
        """Return a fresh controller.

        Args:
            watch: Who listens for slip; one of its own if not given.
        """
        config = self.config
        belief, need = belief_of(config, self.believed), need_of(config)
        grip = self._grip(belief, watch or self.watch(), need)
        lift = LiftController(grip, PERIOD, self.lift)
        carry: Carry = lift
        first = GraspStage.CLOSE
        if isinstance(belief, NudgedSurface):
            hand = hand_of(config)
            center = (0.0, 0.0, -(hand.depth + hand.tip_along))
            nudge = NudgeController(config.fingers, PERIOD, _nudging(center))
            carry, first = NudgeAndLift(nudge, belief, lift), GraspStage.NUDGE
        down = SetDownParameters(height=config.lift_height, speed=LOWERING_SPEED, acceleration=LIFT_ACCELERATION)
        return GraspController(carry, grip, PERIOD, down, first=first)

    def _grip(self, belief: SurfaceBelief, watch: NotedWatch, need: GripNeed) -> SlipSafeGrip:
        parameters, n = GripParameters(margin=self.config.margin, largest_grip=LARGEST_GRIP), self.config.fingers
        if self.config.known == "untouched":
            return RippledGrip(n, belief, PERIOD, RIPPLE, parameters, watch, need)
        return SlipSafeGrip(n, belief, PERIOD, parameters, watch, need)

    def ignoring_spin(self) -> "GraspPlan":
        """Return the same, planned by Coulomb's law alone."""
        config = replace(self.config, ignore_spin=True, against_ignoring_spin=False)
        return replace(self, config=config)

    def texts(self) -> dict[str, str]:
        """Everything from which the very same is planned again, by file name."""
        texts = {GRASP_TEXT: grasp_text(self.config)}
        return {**texts, KNOWN_TEXT: self.known} if self.known else texts


def need_of(config: GraspConfig) -> GripNeed:
    """Return how a load's need is reckoned."""
    return NeedWithoutSpin() if config.ignore_spin else NeedWithSpin()


def plan(config: GraspConfig) -> GraspPlan:
    """Return a grasp, planned.

    Raises:
        InvalidValueError: The friction file cannot be read, or something cannot be.
    """
    if config.friction_file is None:
        return plan_with(config, NOTHING)
    try:
        found = load_friction_file(config.friction_file)
        return plan_with(config, {KNOWN_TEXT: friction_file_text(found)})
    except InvalidValueError as error:
        raise InvalidValueError(f"friction_file = {config.friction_file}: {error}") from None


def plan_with(config: GraspConfig, texts: Mapping[str, str]) -> GraspPlan:
    """Return a grasp, planned with what a log's texts say of friction."""
    believed = believed_surface(config, texts)
    hand = hand_of(config)
    gap = hand.opening - tip_radius(hand) - config.half_width
    closed = max(gap, 0.0) / hand.closing_speed + CONTACT_TIME
    rise = config.lift_height / config.lift_speed + config.lift_speed / LIFT_ACCELERATION
    lift = LiftParameters(height=config.lift_height, speed=config.lift_speed, acceleration=LIFT_ACCELERATION)
    begin = closed + 2.0 * lift.settle_time + rise + SPARE
    if config.known == "nudged":
        begin += nudge_time()
    times = pull_times(config, begin)
    lift = replace(lift, hold_time=times.gone - begin + 2.0 * SPARE)
    return GraspPlan(config, believed, times, lift, texts.get(KNOWN_TEXT, ""))


def tip_radius(hand: Hand) -> float:
    """Return the radius of a hand's fingertips [m], which are spheres."""
    surface = hand.tip.surface
    assert isinstance(surface, Sphere)
    return float(surface.radius)


def _nudging(center: Vector) -> NudgeParameters:
    return NudgeParameters(NUDGING_GRIP, center, spin=NUDGING_SPIN)


def nudge_time() -> float:
    """Return how long a nudge takes, from the last finger's touch [s]."""
    p = _nudging(ZERO)
    return 2.0 * p.settle_time + p.stroke / p.speed + 2.0 * p.angle / p.spin


def plan_from_texts(texts: Mapping[str, str]) -> GraspPlan:
    """Return the plan of a recorded grasp.

    Raises:
        InvalidValueError: Something in the texts is wrong.
    """
    return plan_with(read_grasp(texts[GRASP_TEXT]), texts)
