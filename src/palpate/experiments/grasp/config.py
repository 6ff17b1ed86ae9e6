"""The options of a grasp; imports nothing heavy, so that `palpate --help` is quick."""

from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Literal

from palpate.errors import InvalidValueError
from palpate.experiments.kit.checks import check_friction, check_seed, check_size, check_spin_length
from palpate.experiments.kit.options import NOISY, TOUCHED, check_options, option, own_first, with_default
from palpate.experiments.kit.scene_options import DriftOptions, LimitSurfaceOptions, ObjectOptions, SceneOptions

_HeldName = Literal["box", "cylinder", "sphere"]
_LoadName = Literal["ramp", "step", "shake", "none"]
Knowledge = Literal["touched", "nudged", "untouched", "estimated"]

SIZES: dict[_HeldName, tuple[float, ...]] = {
    "box": (0.06, 0.05, 0.06),
    "cylinder": (0.03, 0.06),
    "sphere": (0.03,),
}
"""Length, width and height; radius and height; radius by default [m]."""

WIDEST = 0.031
"""Largest half width of an object between the fingers [m]: open, they are 32 mm from the hand's axis."""

_LARGEST_PULL = 8.0
"""[N] With offset and little friction it takes more grip than the fingers have."""

HIGHEST_LIFT = 0.3
"""Travel of a vertical slide that carries a hand of this size [m]."""

FASTEST_LIFT = 0.25
"""[m/s] The supervisor's limit (reduced speed of ISO 10218-1:2011, section 5.6.2)."""

_FASTEST_SHAKE = 40.0
"""Largest frequency of a shake [Hz]. The control leads a load of 5 to 10 Hz; faster ones take a margin."""

_LARGEST_MARGIN = 3.0
"""Largest margin of the grip, as in `palpate.controllers.grip.parameters`."""

_RISES: dict[_LoadName, float] = {"ramp": 1.5, "step": 0.05, "shake": 2.0, "none": 1.0}
"""How long the load grows, shakes, or is waited for, by default [s]."""

_PULLS: dict[_LoadName, float] = {"ramp": 4.0, "step": 3.0, "shake": 1.0, "none": 0.0}
"""Largest force, or amplitude, by default [N]."""

SPREADS: dict[Knowledge, tuple[float, float]] = {
    "touched": (0.03, 0.05),
    "nudged": (0.3, 0.5),
    "untouched": (0.3, 0.5),
    "estimated": (0.15, 0.25),
}
"""Largest relative errors of the initial mu and e; standard deviations for an estimate."""

_MOST_PROBABLE = 0.999
"""Largest probability of holding: an estimate as wide as that of e allows no more."""

THREE = 3

KNOWN_TEXT = "friction.yaml"
"""Under this name a log keeps what rubbing had found, if that was planned with."""

_PULLED = "the samples are as recorded, with what pulled then"
"""Why a replay cannot change an option."""


@own_first
@dataclass(frozen=True)
class GraspConfig(SceneOptions, ObjectOptions, DriftOptions, LimitSurfaceOptions):
    """Grip an object, lift it, pull at it, set it down; see whether it slips or spins, and what grip it took.

    A simulated hand with a force/torque sensor behind each fingertip closes on an object on a table, lifts it and
    holds it with the least force that neither lets it slip nor spin: the limit surface of each contact, from mu
    (tangential over normal force) and e (torque over mu times normal force), gives the grip that its load needs.
    Meanwhile the object is pulled at beside the fingers, so that it tends to spin. The report shows the grip
    against the theoretical minimum, slip and spin by the simulation's truth, and plays the forces in space and the
    load inside each limit surface, the worst moment first. A fault never opens the hand.

    All values are in SI units: metres, newtons, seconds, kilograms.

    Example, a pull that grows to 4 N, 6 mm beside the fingers, friction known from a touch:
    palpate grasp

    Example, the same, compared with a control that ignores spin, which fails as expected:
    palpate grasp --against-ignoring-spin

    Example, a jump of the load within 50 ms:
    palpate grasp --load step

    Example, a step of 2.5 N within 5 ms, announced 15 ms before, and one that is not announced:
    palpate grasp --load step --rise 0.005 --announced 0.015
    palpate grasp --load step --rise 0.005 --preload 2.5

    Example, held for ten minutes, while the sensors' zeros wander:
    palpate grasp --load none --rise 600

    Example, friction known within 30 % and e within 50 %, measured by a nudge before the lift:
    palpate grasp --known nudged

    Example, the same without a nudge: planned for the worst case, with slip detection:
    palpate grasp --known untouched

    Example, what rubbing has found first (palpate friction): the object then rubs as that surface does
    palpate grasp --friction-file runs/friction/friction.yaml

    Example, three fingers and a sphere, each pressing with its part of the least grip:
    palpate grasp --fingers 3 --object sphere --load shake

    Example, friction that is only estimated, held with a probability of 99 %:
    palpate grasp --fingers 3 --object cylinder --known estimated

    Example, over real wires, with the makers' client libraries: emulated servos, F/T boxes and arm
    palpate grasp --robot emulated-hand
    """

    object: _HeldName = with_default(ObjectOptions, "object", "box")
    """Object to hold: a box, an upright cylinder, or a sphere, standing on a table. Three fingers take no box."""
    size: tuple[float, ...] = with_default(ObjectOptions, "size", ())
    """Size of the object [m]: three lengths of a box (the first between the fingers), radius and height of a
    cylinder, the radius of a sphere. Left out: 0.06 0.05 0.06, 0.03 0.06 and 0.03."""
    mass: float = option(0.1, "kg", fixed=TOUCHED, bound="positive")
    """Mass of the object [kg]."""
    fingers: int = option(2, fixed="the samples are as recorded, of the fingers that there were")
    """Number of fingers: 2 (a parallel gripper) or 3."""
    friction: float | None = with_default(SceneOptions, "friction", None)
    """True friction coefficient mu between fingertips and object. Left out, as spin_length, norm_exponent and
    load_exponent: that of --friction-file, else 0.5."""
    spin_length: float | None = with_default(SceneOptions, "spin_length", None)
    """True e at 1 N: largest spin torque per largest friction force [m]. Left out, and nothing found: 0.004."""
    plant: bool = option(False, fixed=TOUCHED)
    """Rub by the friction plant, whose contacts stick on bristles and report slip, not by MuJoCo. Friction that is
    no ellipse of constant size (--norm-exponent, --load-exponent) needs the plant in any case."""
    known: Knowledge = "touched"
    """How friction is known: touched before (mu within 3 %, e within 5 %), nudged before the lift (30 % and 50 %
    until the fingers have slid a little down its sides), untouched (the same, and no nudge: planned for the worst
    that is likely, while a ripple on the grip detects slip, and slip corrects the belief), or estimated
    (standard deviations of 15 % and 25 %: planned so that it holds with --probability)."""
    probability: float = option(0.99, within=(0.5, _MOST_PROBABLE), remark="; 0.99 stands for 99 %")
    """Probability of holding, if friction is estimated: 0.5 to 0.999. To hold is that, pressed as planned, some
    friction within the true limits balances the true load: a finger that comes to its limit creeps, others take
    over."""
    believed_friction: float | None = option(None, check=check_friction)
    """Initial estimate of mu. Left out, as the next: the seed draws it, within the range of --known."""
    believed_spin_length: float | None = option(None, "m", check=check_spin_length)
    """Initial estimate of e [m]."""
    friction_file: Path | None = option(None, kept=KNOWN_TEXT)
    """File friction.yaml of `palpate friction`: source of the initial estimates, and of the simulated object's
    friction unless options give it."""
    load: _LoadName = option("ramp", fixed=_PULLED)
    """Load on the lifted object: a force that grows, that jumps, one that shakes up and down and
    sideways, or nothing."""
    pull: float | None = option(None, "N", fixed=_PULLED, bound="positive")
    """Largest force [N]; of a shake, its amplitude. Left out: 4 for a ramp, 3 for a step, 1 for a shake."""
    pull_before: float = option(0.5, "N", fixed=_PULLED, bound="not negative")
    """Force before it grows [N]."""
    rise: float | None = option(None, "s", fixed=_PULLED, bound="positive")
    """How long it grows or shakes [s]. Left out: 1.5 for a ramp, 0.05 for a step, 2 for a shake."""
    shake_frequency: float = option(5.0, "Hz", fixed=_PULLED, bound="positive", within=(-inf, _FASTEST_SHAKE))
    """Frequency of a shake [Hz]."""
    offset: float = option(0.006, "m", fixed=_PULLED, bound="not negative")
    """How far beside the line of the contacts it pulls [m]."""
    lift_height: float = option(
        0.04, "m", bound="positive", within=(-inf, HIGHEST_LIFT), remark=", what the lift travels"
    )
    """How far the object is lifted [m]."""
    lift_speed: float = option(
        0.06, "m/s", bound="positive", within=(-inf, FASTEST_LIFT), remark=", as the supervisor has it"
    )
    """With which speed [m/s]."""
    margin: float = option(
        0.12, bound="not negative", within=(-inf, _LARGEST_MARGIN), remark="; 0.12 stands for 12 %"
    )
    """Share of grip beyond the need of the limit surface."""
    preload: float = option(0.0, "N", bound="not negative", within=(-inf, _LARGEST_PULL))
    """Largest unannounced step of load [N], within 5 ms and --offset aside, that the grip carries without slip;
    the grip is kept for it from the first touch on. A note before the run states the cost."""
    announced: float | None = option(None, "s", bound="positive")
    """Time before the pull grows at which it is announced to the grip [s], as by a script that knows its next
    step. Left out: the pull is not announced."""
    controller: Literal["limit-surface", "coulomb"] = "limit-surface"
    """Grip law: limit-surface carries force and torque; coulomb plans by Coulomb's law alone, as if there were no
    torque, for comparison only."""
    against_ignoring_spin: bool = option(
        False, fixed="the log is of the first of both; set controller=coulomb", once=True
    )
    """Do it again with a control that ignores spin, and show both."""
    force_noise: float = option(0.01, "N", fixed=NOISY, bound="positive")
    """Standard deviation of the sensors' force noise [N], each axis, as of a Nano17; the next two also."""
    moment_noise: float = option(1e-4, "N m", fixed=NOISY, bound="positive")
    """Standard deviation of their moment noise [N m]."""
    drift: float = with_default(DriftOptions, "drift", 0.06)
    """Drift of the sensors' zeros [N/min], each axis up or down, and a hundredth of that for moments [N m/min]."""
    seed: int = option(
        0,
        fixed="the samples are as recorded, with its noise and what it drew to be believed; set believed_friction",
        check=check_seed,
    )
    """Seed of noise, drift and the assumed friction: the same seed gives the same run."""
    robot: str | None = option(None, fixed="the samples are as recorded, of the hand that there was")
    """A robot that comes with palpate and has a hand (emulated-hand, panda-hand, ur5e-hand), or a robot file. Left
    out: the simulated hand. The truth of a real one is unknown: the belief is typed or comes from --friction-file.
    Its open hand is placed around the object before the run, and nothing pulls but the people there."""
    out: Path = Path("runs/grasp")
    """Folder for the report, the table and the log."""

    def __post_init__(self) -> None:
        check_options(self)
        self._check_hand()
        self._check_load()
        if self.friction_file is not None and (self.believed_friction or self.believed_spin_length):
            raise InvalidValueError(
                "friction_file with believed_friction or believed_spin_length: what is believed comes from "
                "one or the other; leave one out"
            )
        if self.friction_file is not None and self.known != "touched":
            raise InvalidValueError(
                f"friction_file with known = {self.known}: a file comes from a touch; leave --known out"
            )
        if self.ignores_spin and self.against_ignoring_spin:
            raise InvalidValueError(
                "controller = coulomb with against_ignoring_spin: both would be the same; leave one out"
            )

    def _check_hand(self) -> None:
        if self.fingers not in (2, THREE):
            raise InvalidValueError(f"fingers = {self.fingers}: must be 2 or 3")
        check_size(self.object, self.size, SIZES[self.object])
        if self.half_width > WIDEST:
            raise InvalidValueError(
                f"size: {2.0 * self.half_width:g} m between the fingers; must be at most {2.0 * WIDEST:g} m, as "
                "far as the hand opens"
            )
        if self.fingers == THREE and self.object == "box":
            raise InvalidValueError(
                "object = box with fingers = 3: three fingers stand 120 degrees apart and do not meet a box "
                "squarely; take a cylinder or a sphere"
            )
        if self.fingers == THREE and self.known == "nudged":
            raise InvalidValueError(
                "known = nudged with fingers = 3: the nudge twists two opposed fingers; take touched or untouched"
            )

    def _check_load(self) -> None:
        if max(self.largest_pull, self.pull_before) > _LARGEST_PULL:
            raise InvalidValueError(
                f"pull = {self.largest_pull:g} N, pull_before = {self.pull_before:g} N: must be at most "
                f"{_LARGEST_PULL:g} N"
            )
        if self.announced is not None and self.load == "none":
            raise InvalidValueError("announced with load = none: nothing pulls; leave one out")
        if self.offset > self.half_width:
            raise InvalidValueError(
                f"offset = {self.offset:g} m: must be within the object, at most {self.half_width:g} m"
            )

    @property
    def drift_rate(self) -> float:
        """Drift of the zeros of the forces [N/s]."""
        return self.drift / 60.0

    @property
    def ignores_spin(self) -> bool:
        """Whether the grip is planned as if there were no torque."""
        return self.controller == "coulomb"

    @property
    def sizes(self) -> tuple[float, ...]:
        """Size of the object [m]."""
        return self.size or SIZES[self.object]

    @property
    def half_width(self) -> float:
        """Half width of the object between the fingers [m]."""
        return 0.5 * self.sizes[0] if self.object == "box" else self.sizes[0]

    @property
    def half_height(self) -> float:
        """Half height of the object [m]."""
        return self.sizes[0] if self.object == "sphere" else 0.5 * self.sizes[-1]

    @property
    def largest_pull(self) -> float:
        """Largest force that pulls, or amplitude of a shake [N]."""
        return _PULLS[self.load] if self.pull is None else self.pull

    @property
    def rising(self) -> float:
        """How long the load grows or shakes [s]."""
        return _RISES[self.load] if self.rise is None else self.rise
