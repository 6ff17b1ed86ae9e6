"""The options of a friction measurement; imports nothing heavy, so that `palpate --help` is quick."""

from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Literal

from palpate.errors import InvalidValueError
from palpate.experiments.kit.checks import (
    MAX_FORCE,
    check_size,
)
from palpate.experiments.kit.options import TOUCHED, check_options, option, own_first, with_default
from palpate.experiments.kit.scene_options import (
    DriftOptions,
    FingerOptions,
    LimitSurfaceOptions,
    ObjectOptions,
    SceneOptions,
)
from palpate.friction.limit_surface import LimitSurface

_RubbedName = Literal["plate", "box", "sphere"]

SIZES: dict[_RubbedName, tuple[float, ...]] = {
    "plate": (0.2, 0.2, 0.04),
    "box": (0.08, 0.08, 0.04),
    "sphere": (0.04,),
}
"""Default length, width and height, or radius [m]."""


EXPONENT_SLIPS = 18
"""There and back: with 3 % scatter they determine p within 0.15 and gamma within 0.05 in 95 % of all trials."""

_SLOWEST_RUB = 1e-4
"""[m/s] The least travel takes 40 s then; what moves so slowly creeps, and only looks like slip."""

_CREEP = "; slower, strokes take minutes and creep looks like slip"
"""Remark on speeds below `_SLOWEST_RUB`."""

_SOFTEST_SKIN = 1.0
"""Lower bound on the stiffness of a skin [N/m]: a softer one yields too far before the smallest load slips."""

_CALIBRATED = 0.003
"""Standard deviation of the ratio of two loads on different axes after a calibration on the spot."""

_LARGEST_CALIBRATION = 0.2
"""More is no calibration, or in per cent."""

_MOST_REPEATS = 100
"""They average the noise down to a tenth, in an hour of rubbing."""

STIFFNESS = 4e3
"""Stiffness of a rubber fingertip on something hard [N/m]."""

LIBRARY_TEXT = "library.yaml"
"""Under this name a log keeps the library."""


@own_first
@dataclass(frozen=True)
class FrictionConfig(FingerOptions, ObjectOptions, DriftOptions, LimitSurfaceOptions):
    """Rub a fingertip on an unknown surface, to measure the load at which a contact slips.

    A fingertip on a six-axis force/torque sensor lands, presses with each load, slides there and back, turns about
    the contact's normal and back, and lifts off. From that come mu (tangential over normal force in slip) and e
    (torque over mu times normal force in spinning slip) with 95 % intervals, how e grows with the load, how mu
    depends on the speed, and, with --fit-exponents, how force and torque share. What never slipped gives a lower
    bound, and is called one. friction.yaml keeps what was found, for a grasp that follows.

    All values are in SI units: metres, newtons, seconds.

    Example, a surface with mu = 0.8, e = 2 mm:
    palpate friction --friction 0.8 --spin-length 0.002

    Example, quickly, with one speed and two loads:
    palpate friction --quick

    Example, a surface unlike an ellipse, whose e grows with the load, and its exponents:
    palpate friction --norm-exponent 1.5 --load-exponent 0.2 --fit-exponents

    Example, one whose mu falls with the speed, rubbed at more of them:
    palpate friction --static-friction 0.7 --stribeck-speed 0.005 --speeds 0.002 0.004 0.008 0.016 0.032

    Example, one whose skin gives way for longer than the finger may rub, so that it never slips:
    palpate friction --skin-stiffness 40

    Example, with the noise and the drift of a real sensor:
    palpate friction --force-noise 0.01 --moment-noise 1e-4 --drift 0.06

    Example, which surface of a library it is:
    palpate friction --friction 0.33 --spin-length 0.0024 --load-exponent 0.15 --library simulated

    Afterwards `palpate replay runs/friction` computes every command again, from the log.
    """

    object: _RubbedName = with_default(ObjectOptions, "object", "plate")
    """Object to rub: the top of a plate of 0.2 x 0.2 m, of a box of 80 x 80 x 40 mm, or of a sphere of 40 mm
    radius."""
    size: tuple[float, ...] = with_default(ObjectOptions, "size", ())
    """Size of the object [m]: three lengths of plate or box, the radius of a sphere. Left out: as above."""
    friction: float = with_default(SceneOptions, "friction", 0.5)
    """True friction coefficient mu of the simulated surface; its kinetic one if the friction plant rubs."""
    spin_length: float = with_default(SceneOptions, "spin_length", 0.003)
    """True e of the simulated surface at 1 N: largest spin torque per largest friction force [m]."""
    static_friction: float | None = option(None, fixed=TOUCHED, bound="positive")
    """True mu at rest, at least --friction. This, the next three, --norm-exponent and --load-exponent make the
    friction plant rub; with all of them left out it is MuJoCo, whose friction is an ellipse."""
    stribeck_speed: float | None = option(None, "m/s", fixed=TOUCHED, bound="positive")
    """How fast mu falls from static to kinetic [m/s]; goes with --static-friction. Left out: 0.01."""
    viscous_friction: float | None = option(None, "s/m", fixed=TOUCHED, bound="not negative")
    """How mu grows with the slip speed [s/m]."""
    skin_stiffness: float | None = option(
        None, "N/m", fixed=TOUCHED, bound="positive", within=(_SOFTEST_SKIN, inf)
    )
    """How stiffly finger and surface hang together along the surface until they slip [N/m]. Left out: 20e3."""
    loads: tuple[float, ...] = option((1.0, 2.0, 4.0), "N", bound="positive")
    """Normal forces to rub with, rising [N]."""
    speed: float = option(0.01, "m/s", bound="positive", within=(_SLOWEST_RUB, inf), remark=_CREEP)
    """Slip speed of strokes at every load; twists come as near to it as the robot can turn [m/s]."""
    speeds: tuple[float, ...] = option(
        (0.0025, 0.005, 0.02, 0.04), "m/s", bound="positive", within=(_SLOWEST_RUB, inf), remark=_CREEP
    )
    """More speeds, at the middle load: for mu over speed, and because creep looks like slip at any single one
    [m/s]. On a sphere only those whose strokes are short enough for it."""
    travel: float = option(0.004, "m", bound="positive")
    """Least travel of a stroke [m]; one that has not slipped yet goes farther, up to --most-travel."""
    most_travel: float | None = option(None, "m", bound="positive")
    """How far a stroke may go [m]. Left out: 25 mm, less on what is smaller or curved."""
    repeats: int = option(1, within=(1, _MOST_REPEATS))
    """How often each stroke and twist is done: twice as often means 0.7 times the noise."""
    quick: bool = False
    """One speed, and only the least and the largest load."""
    fit_exponents: bool = False
    """Slide and turn at once, too, 18 times there and back at the least and the largest load: for p, gamma."""
    stiffness: float = option(STIFFNESS, "N/m", fixed=TOUCHED, bound="positive")
    """Stiffness of the simulated contact along the normal [N/m]."""
    calibration: float | None = option(
        None,
        fixed="a replay computes commands, and no intervals; rub again",
        bound="not negative",
        within=(-inf, _LARGEST_CALIBRATION),
        remark="; 0.01 stands for 1 %",
    )
    """Uncertainty of the sensor's calibration in the intervals: standard deviation of the ratio of two loads on
    different axes. 0.003 after a calibration on the spot, 0.01 as sensors are delivered. Left out: 0.003; of a
    simulated sensor 0.001 without cross-talk, 0.01 with it."""
    drift: float = with_default(DriftOptions, "drift", 0.0)
    """Drift of the sensor's zero along its z [N/min], and a hundredth of that about x [N m/min]. The finger feels
    the zero in free air before and after. A robot whose sensor is perfect needs --force-noise and
    --moment-noise."""
    library: Path | None = option(None, fixed="a replay recognises nothing; rub again", kept=LIBRARY_TEXT)
    """Library of surfaces (YAML), or `simulated` for the one that comes with palpate, materials/simulated.yaml in
    its package: the surface is recognised among them, or as none of them, and the most informative next
    touch is recommended. The report names the file that was read, and each of its surfaces."""
    robot: str = with_default(SceneOptions, "robot", "turning-stage")
    """Robot that carries the fingertip: one that comes with palpate (`palpate robot list`), or a robot file. One
    that cannot turn its tip finds mu, but not e."""
    out: Path = Path("runs/friction")
    """Folder for friction.yaml, the report and the log."""

    def __post_init__(self) -> None:
        check_options(self)
        self._check_surface()
        check_size(self.object, self.size, SIZES[self.object])
        self._check_loads()

    def _check_surface(self) -> None:
        """Refuse what no surface can be now, not once everything is built."""
        if self.stribeck_speed is not None and self.static_friction is None:
            raise InvalidValueError(
                f"stribeck_speed = {self.stribeck_speed:g} m/s: does nothing without --static-friction, from "
                "which mu falls to --friction; give that, above --friction, or leave this out"
            )
        p = 2.0 if self.norm_exponent is None else self.norm_exponent
        if p > 2.0:
            raise InvalidValueError(
                f"norm_exponent = {p:g}: must lie between 1 (diamond) and 2 (ellipsoid) to be simulated"
            )
        LimitSurface(self.friction, self.spin_length, self.load_exponent or 0.0, p)
        if self.static_friction is not None and self.static_friction < self.friction:
            raise InvalidValueError(
                f"static_friction = {self.static_friction:g}: must be at least friction = {self.friction:g}, the "
                "kinetic one; for friction that grows with speed give --viscous-friction"
            )

    def _check_loads(self) -> None:
        if not self.loads:
            raise InvalidValueError("loads: there are none; give one at least [N]")
        if list(self.loads) != sorted(set(self.loads)):
            loads = " ".join(f"{load:g}" for load in self.loads)
            raise InvalidValueError(f"loads = {loads}: must rise, each above the one before")
        if self.loads[-1] > MAX_FORCE:
            raise InvalidValueError(f"loads = {self.loads[-1]:g} N: must be at most {MAX_FORCE:g} N")
        if self.fit_exponents and self.loads[-1] < 2.0 * self.loads[0]:
            raise InvalidValueError(
                f"loads from {self.loads[0]:g} to {self.loads[-1]:g} N: for --fit-exponents the largest must be "
                "at least twice the least, or the growth of e cannot be measured"
            )

    @property
    def usual_calibration(self) -> float:
        """Uncertainty of the calibration, with the default of a real sensor."""
        return _CALIBRATED if self.calibration is None else self.calibration

    @property
    def sizes(self) -> tuple[float, ...]:
        """Size of the object [m]."""
        return self.size or SIZES[self.object]

    @property
    def on_plant(self) -> bool:
        """Whether the friction plant rubs, not MuJoCo."""
        return any(getattr(self, name) is not None for name in _PLANT)

    @property
    def rubbed_loads(self) -> tuple[float, ...]:
        """With which it rubs [N]."""
        return tuple(dict.fromkeys((self.loads[0], self.loads[-1]))) if self.quick else self.loads


_PLANT = (
    "norm_exponent",
    "load_exponent",
    "static_friction",
    "stribeck_speed",
    "viscous_friction",
    "skin_stiffness",
)
"""Options that only the friction plant can do."""
