"""What a regulation of force is to be like; imports nothing heavy, so that `palpate --help` is quick."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from palpate.errors import InvalidValueError, positive
from palpate.experiments.explore.config import (
    MOST_FORCE,
    check_force_noise,
)
from palpate.experiments.kit.change_names import REGULATED, check_change_names
from palpate.experiments.kit.config_checks import (
    check_length,
    check_not_negative,
    check_period,
    check_positive,
    check_seed,
    check_tip,
    given,
    speed_hint,
)
from palpate.experiments.kit.friction_checks import check_friction, check_spin_length
from palpate.experiments.kit.owned_options import Owners, check_owned, given_owned
from palpate.experiments.kit.settled_values import settle
from palpate.experiments.regulate.surfaces import FASTEST_LEAVING, LARGEST_AMPLITUDE, SURFACE_OPTIONS, SurfaceName

PressedName = Literal["plate", "sphere"]
ProfileName = Literal["constant", "step", "ramp", "sine"]
MotionName = Literal["still", "sine", "circle", "path", "table"]

PROFILE_OPTIONS: Mapping[ProfileName, tuple[str, ...]] = {
    "constant": ("duration",),
    "step": ("swing", "hold", "duration"),
    "ramp": ("swing", "rate", "duration"),
    "sine": ("swing", "frequencies"),
}
"""Fields of `RegulateConfig` that say what a profile is like; any other is of no use to it, and refused."""

MOTION_OPTIONS: Mapping[MotionName, tuple[str, ...]] = {
    "still": (),
    "sine": ("motion_size", "motion_speed"),
    "circle": ("motion_size", "motion_speed"),
    "path": ("motion_file",),
    "table": ("motion_file",),
}
"""Likewise of a motion."""

CHOICES: Mapping[str, Owners] = {"surface": SURFACE_OPTIONS, "profile": PROFILE_OPTIONS, "motion": MOTION_OPTIONS}
"""Options that say which others there are."""

STIFFNESS, SOFT_STIFFNESS = 20e3, 1e3
"""Of the simulated contact, hard and soft [N/m], if nothing else is said."""

FROM_FILES = tuple(name for name, options in MOTION_OPTIONS.items() if "motion_file" in options)
"""Motions that a file says."""

LARGEST_MOTION = 0.05
"""Half of the way that something else may move the tip along a plate [m]: the plate is 0.2 m wide."""


@dataclass(frozen=True, slots=True)
class RegulateConfig:
    """Hold a force on a simulated surface, still, moving or yielding, while something else moves the arm.

    A fingertip on a six-axis force/torque sensor lands on the surface, settles, holds the force profile and lifts
    off. The report shows the force, set, felt and true, how it answers to steps (rise, overshoot, settling) or
    to sines (amplitude, phase, bandwidth), what limits that, and the margins of the force control.

    All values are in SI units: metres, newtons, seconds.

    Example, a force held on a plate that goes up and down, while a circle is drawn on it:
    palpate regulate --surface sine --motion circle

    Example, how steps are answered on a plate on springs, whose stiffness is found by pressing first:
    palpate regulate --surface yielding --profile step --identify

    Example, the bandwidth on the UR5e:
    palpate regulate --profile sine --robot ur5e-sim

    Example, while a recorded motion (CSV: time, x, y, z) is played:
    palpate regulate --motion path --motion-file recorded.csv

    Afterwards `palpate replay runs/regulate` computes every command again, from the log.
    """

    object: PressedName = "plate"
    """What is pressed on: a plate of 0.2 x 0.2 m, or a sphere of 40 mm radius."""
    surface: SurfaceName = "still"
    """What it does: stand still; go up and down as a sine; stand still and be soft; yield, on a mount with spring
    and damper; leave in the middle of the run; or not be there at all."""
    surface_amplitude: float = 0.01
    """Half of the way that a sine surface goes [m]."""
    surface_speed: float = 0.02
    """Its largest speed; and the speed of one that leaves [m/s]."""
    leave_time: float = 5.0
    """When one that leaves does so [s]."""
    mount_stiffness: float = 2e3
    """Of the spring that a yielding surface is mounted on [N/m]."""
    mount_damping_ratio: float = 0.7
    """Of that mount by itself: 1 is critical."""
    mount_mass: float = 1.0
    """What moves on it [kg]."""
    profile: ProfileName = "constant"
    """Of the force: constant; steps up and down by the swing; one ramp up by the swing; or sines about the force
    with the swing as amplitude."""
    force: float = 2.0
    """Normal force to hold [N]."""
    swing: float | None = None
    """See --profile [N]. Left out: half of the force."""
    rate: float = 1.0
    """Of the ramp [N/s]."""
    hold: float = 1.0
    """How long each of the steps' forces lasts [s]."""
    frequencies: tuple[float, ...] = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0)
    """Of the sines, one after the other [Hz]."""
    duration: float = 8.0
    """How long the profile is held [s]; sines take what they need."""
    motion: MotionName = "still"
    """How something else moves the tip along the surface meanwhile: not at all; to and fro along x; on a circle;
    on a recorded path, positions over time; or as a table of velocities says. What of it would press or lift is
    left out: that is force control's."""
    motion_size: float = 0.005
    """Half of the way to and fro, or the circle's radius [m]."""
    motion_speed: float = 0.02
    """Largest speed of that [m/s]."""
    motion_file: Path | None = None
    """Of a path: CSV with time [s] and position x, y and z [m], one line each, wherever they begin; of a table:
    with time [s] and velocity along x, y and z [m/s]."""
    axis: tuple[float, ...] = ()
    """Along which the force is regulated: three numbers, into the object. Left out: along the contact's normal."""
    identify: bool = False
    """Press first, to find stiffness and delay, and set the gain by that; what moves stands still meanwhile."""
    stiffness: float | None = None
    """Of the simulated contact [N/m]. Left out: 20e3; 1e3 if the surface is soft."""
    assumed_stiffness: float | None = None
    """What the gain is made for [N/m]: of contact and mount together. Left out: the true one. It may be off by
    a factor of 3: beyond half or twice the true one force control may swing, which it notices, and goes on with
    half of its gain; the report's margins have the numbers."""
    assumed_damping_time: float | None = None
    """Likewise damping per stiffness [s]: what is damped is pressed with a smaller gain. Left out: that of the
    simulated contact."""
    change: tuple[tuple[float, str, float], ...] = ()
    """Change force [N] or force_gain [m/s/N] while it runs: seconds after the start, name, new value, as in
    --change 5 force 3. The start is that of the run: on the way down and while it lands, a change counts already
    and what was to be held before is never held. A profile moves with the force. The change is ramped, so that
    nothing jumps."""
    landing_speed: float | None = None
    """[m/s]. Left out: so that the force of landing exceeds the set one by no more than about 1 N, at most 5 mm/s;
    0.5 mm/s on a sine surface, which is then met near its turning point."""
    friction: float = 0.3
    """Friction coefficient between tip and object."""
    spin_length: float = 0.004
    """Largest spin torque per largest friction force [m]."""
    drift: float = 0.0
    """Of the sensor's zero along its z [N/min], for a robot whose sensor has a range (as stage-nano17)."""
    tip: tuple[float, ...] = ()
    """Fingertip [m]: one number for the radius of a sphere, three for the semi-axes of an ellipsoid. Left out, as
    the next three: what the robot file says."""
    force_noise: float | None = None
    """Standard deviation of the sensor's force noise [N], each axis."""
    moment_noise: float | None = None
    """Standard deviation of the sensor's moment noise [N m], each axis."""
    period: float | None = None
    """Control period [s]."""
    seed: int = 0
    """Seed of the noise: the same seed gives the same run."""
    robot: str = "stage"
    """What carries the fingertip: a robot that comes with palpate (`palpate robot list`), or a robot file."""
    out: Path = Path("runs/regulate")
    """Folder for the report and the log."""

    def __post_init__(self) -> None:
        settle(self)
        check_positive(self, _POSITIVE)
        check_positive(self, given(self, _POSITIVE_IF_GIVEN))
        check_not_negative(self, _NOT_NEGATIVE)
        check_not_negative(self, given(self, _NOT_NEGATIVE_IF_GIVEN))
        check_change_names(self.change, REGULATED)
        check_friction(self.friction)
        check_spin_length(self.spin_length)
        if self.force_noise is not None:
            check_force_noise(self.force_noise)
        check_tip(self.tip)
        check_seed(self.seed)
        check_period(self.period)
        if self.axis and not (len(self.axis) == 3 and 0.0 < math.hypot(*self.axis) < math.inf):
            raise InvalidValueError(f"axis = {self.axis}: give three numbers that are not all 0")
        for option, owners in CHOICES.items():
            check_owned(option, getattr(self, option), owners, given_owned(self, owners))
        self._check_surface()
        self._check_profile()
        self._check_motion()

    def _check_surface(self) -> None:
        check_length("surface_amplitude", self.surface_amplitude, LARGEST_AMPLITUDE)
        if self.surface == "leaving" and self.surface_speed > FASTEST_LEAVING:
            raise InvalidValueError(
                f"surface_speed = {self.surface_speed:g} m/s: must be at most {FASTEST_LEAVING:g} m/s"
                f"{speed_hint(self.surface_speed, FASTEST_LEAVING)}"
            )

    def _check_profile(self) -> None:
        if self.greatest > MOST_FORCE:
            left_out = " (swing: left out, half of it)" if self.swing is None else ""
            raise InvalidValueError(
                f"force = {self.force:g} N and swing = {self.swung:g} N{left_out}: together at most "
                f"{MOST_FORCE:g} N"
            )
        if self.profile == "sine" and self.swung >= self.force:
            raise InvalidValueError(
                f"swing = {self.swung:g} N: must be less than the force of {self.force:g} N, or the tip would "
                "have to pull"
            )
        for frequency in self.frequencies:
            positive("frequencies", frequency, "Hz")
        if not self.frequencies:
            raise InvalidValueError("frequencies: there are none; give one at least [Hz]")
        if self.profile == "step" and self.duration < 2.0 * self.hold:
            raise InvalidValueError(
                f"duration = {self.duration:g} s: must be at least twice the hold of {self.hold:g} s, or nothing "
                "steps"
            )

    def _check_motion(self) -> None:
        if self.motion in FROM_FILES and self.motion_file is None:
            raise InvalidValueError(f"motion = {self.motion}: a file must say which (--motion-file)")
        if self.motion_size > LARGEST_MOTION:
            raise InvalidValueError(
                f"motion_size = {self.motion_size:g} m: must be at most {LARGEST_MOTION:g} m, or the tip would "
                "leave the object"
            )

    @property
    def swung(self) -> float:
        """The swing [N]."""
        return 0.5 * self.force if self.swing is None else self.swing

    @property
    def greatest(self) -> float:
        """The largest force of the profile [N]."""
        return self.force if self.profile == "constant" else self.force + self.swung

    @property
    def least(self) -> float:
        """The smallest force of the profile [N]."""
        return self.force - self.swung if self.profile == "sine" else self.force

    @property
    def true_stiffness(self) -> float:
        """Of the simulated contact [N/m]."""
        if self.stiffness is not None:
            return self.stiffness
        return SOFT_STIFFNESS if self.surface == "soft" else STIFFNESS


_POSITIVE = {
    "surface_speed": "m/s",
    "mount_stiffness": "N/m",
    "mount_damping_ratio": "",
    "mount_mass": "kg",
    "force": "N",
    "rate": "N/s",
    "hold": "s",
    "duration": "s",
    "motion_size": "m",
    "motion_speed": "m/s",
}

_POSITIVE_IF_GIVEN = {
    "swing": "N",
    "stiffness": "N/m",
    "assumed_stiffness": "N/m",
    "landing_speed": "m/s",
}

_NOT_NEGATIVE = {"leave_time": "s", "drift": "N/min"}

_NOT_NEGATIVE_IF_GIVEN = {"assumed_damping_time": "s", "moment_noise": "N m"}
