"""The options of a force regulation; imports nothing heavy, so that `palpate --help` is quick."""

import math
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Literal

from palpate.errors import InvalidValueError
from palpate.experiments.kit.checks import (
    MAX_FORCE,
    check_change_names,
    check_length,
    speed_hint,
)
from palpate.experiments.kit.options import TOUCHED, check_options, option, own_first, with_default
from palpate.experiments.kit.scene_options import DriftOptions, PressingOptions, SceneOptions

_PressedName = Literal["plate", "sphere", "scene"]
_SurfaceName = Literal["still", "sine", "soft", "yielding", "leaving", "missing"]
_ProfileName = Literal["constant", "step", "ramp", "sine"]
_MotionName = Literal["still", "sine", "circle", "path", "table"]

FROM_FILES = ("path", "table")
"""Motions that are read from a file."""

MOTION_TEXT = "motion.csv"
"""Under this name a log keeps that file."""

_SINE, _MOUNT = ("surface", ("sine",)), ("surface", ("yielding",))
_SCENE = ("object", ("scene",))
_MOVING, _MOVED = ("surface", ("sine", "leaving")), ("motion", ("sine", "circle"))

LIVE = ("force", "force_gain")
"""Live parameters; the controller bounds them."""

STIFFNESS, _SOFT_STIFFNESS = 20e3, 1e3
"""Stiffness of the simulated contact, hard and soft, by default [N/m]."""

MOUNT_DAMPING_RATIO = 0.7
"""Damping ratio of the mount of a yielding surface by itself: 1 is critical."""

LARGEST_MOTION = 0.05
"""Bounds the amplitude of a motion along the plate [m]: the plate is 0.2 m wide."""

_LARGEST_AMPLITUDE = 0.1
"""Bounds the amplitude of a sine surface [m]: an axis of a usual linear stage follows over 0.2 m at most."""

_FASTEST_LEAVING = 1.0
"""Bounds the speed of a surface that leaves [m/s]: what falls is as fast after 5 cm."""


@own_first
@dataclass(frozen=True)
class RegulateConfig(PressingOptions, DriftOptions):
    """Hold a force on a simulated surface, still, moving or yielding, while the arm follows another motion.

    A fingertip on a six-axis force/torque sensor lands on the surface, settles, holds the force profile and lifts
    off. The report shows the force, set, felt and true, its step response (rise, overshoot, settling) or
    frequency response (amplitude, phase, bandwidth), what limits that, and the margins of the force control.

    All values are in SI units: metres, newtons, seconds.

    Example, a force held on a plate that goes up and down, while a circle is drawn on it:
    palpate regulate --surface sine --motion circle

    Example, the step response on a plate on springs, whose stiffness is found by pressing first:
    palpate regulate --surface yielding --profile step --identify

    Example, the bandwidth on the UR5e:
    palpate regulate --profile sine --robot ur5e-sim

    Example, while a recorded motion (CSV: time, x, y, z) is played:
    palpate regulate --motion path --motion-file recorded.csv

    Afterwards `palpate replay runs/regulate` computes every command again, from the log.
    """

    object: _PressedName = option("plate", fixed=TOUCHED)
    """Object to press on: a plate of 0.2 x 0.2 m, a sphere of 40 mm radius, or a part of a scene from a file."""
    file: Path | None = option(None, fixed=TOUCHED, of=_SCENE)
    """The scene: MJCF, with the meshes that it names beside it. It is moved, not turned, so that the touched part
    stands on z = 0 with its middle over the origin, where it is pressed; its joints and springs let it move."""
    surface: _SurfaceName = option("still", fixed=TOUCHED)
    """Behaviour of the object: stand still; move up and down in a sine; stand still and be soft; yield, on a mount
    with spring and damper; leave during the run; or not be there at all."""
    surface_amplitude: float = option(
        0.01, "m", fixed=TOUCHED, of=_SINE, check=partial(check_length, largest=_LARGEST_AMPLITUDE)
    )
    """Amplitude of a sine surface [m]."""
    surface_speed: float = option(0.02, "m/s", fixed=TOUCHED, of=_MOVING, bound="positive")
    """Largest speed of a sine surface, and the speed of one that leaves [m/s]."""
    leave_time: float = option(5.0, "s", fixed=TOUCHED, of=("surface", ("leaving",)), bound="not negative")
    """Time at which a leaving surface leaves [s]."""
    mount_stiffness: float = option(2e3, "N/m", fixed=TOUCHED, of=_MOUNT, bound="positive")
    """Stiffness of the spring that a yielding surface is mounted on [N/m]."""
    mount_mass: float = option(1.0, "kg", fixed=TOUCHED, of=_MOUNT, bound="positive")
    """Mass that moves on it [kg]."""
    profile: _ProfileName = option("constant")
    """Profile of the force: constant; steps up and down by the swing; one ramp up by the swing; or sines about the
    force with the swing as amplitude."""
    force: float = option(2.0, "N", bound="positive")
    swing: float | None = option(None, "N", of=("profile", ("step", "ramp", "sine")), bound="positive")
    """See --profile [N]. Left out: half of the force."""
    rate: float = option(1.0, "N/s", of=("profile", ("ramp",)), bound="positive")
    """Slope of the ramp [N/s]."""
    hold: float = option(1.0, "s", of=("profile", ("step",)), bound="positive")
    """How long each of the steps' forces lasts [s]."""
    frequencies: tuple[float, ...] = option(
        (0.5, 1.0, 2.0, 4.0, 8.0, 16.0), "Hz", of=("profile", ("sine",)), bound="positive"
    )
    """Frequencies of the sines, one after the other [Hz]."""
    duration: float = option(8.0, "s", of=("profile", ("constant", "step", "ramp")), bound="positive")
    """How long the profile is held [s]; sines take what they need."""
    motion: _MotionName = option("still")
    """How something else moves the tip along the surface meanwhile: not at all; to and fro along x; on a circle;
    on a recorded path, positions over time; or by a table of velocities. Its part along the
    normal is left out: that is force control's."""
    motion_size: float = option(
        0.005,
        "m",
        of=_MOVED,
        bound="positive",
        within=(-math.inf, LARGEST_MOTION),
        remark=", or the tip would leave the object",
    )
    """Amplitude of the motion to and fro, or the circle's radius [m]."""
    motion_speed: float = option(0.02, "m/s", of=_MOVED, bound="positive")
    """Largest speed of that motion [m/s]."""
    motion_file: Path | None = option(
        None, fixed="the log keeps it; another one needs another run", of=("motion", FROM_FILES), kept=MOTION_TEXT
    )
    """File of the motion. path: CSV with time [s] and position x, y and z [m], one line each, from any beginning.
    table: CSV with time [s] and velocity along x, y and z [m/s]."""
    axis: tuple[float, ...] = option(())
    """Direction in which force is regulated: three numbers, into the object. Left out: the contact's normal."""
    stiffness: float | None = option(
        None, "N/m", fixed=f"{TOUCHED}; assumed_stiffness is what the gain is made for", bound="positive"
    )
    """Stiffness of the simulated contact [N/m]. Left out: 20e3; 1e3 if the surface is soft."""
    assumed_stiffness: float | None = option(None, "N/m", bound="positive")
    """Stiffness that the gain is made for [N/m]: of contact and mount together. Left out: the true one. It may be
    off by a factor of 3: beyond half or twice the true one force control may swing, which it notices, and goes on
    with half of its gain; the report's margins have the numbers."""
    landing_speed: float | None = option(None, "m/s", bound="positive")
    """Speed of landing [m/s]. Left out: so that its force exceeds the set one by no more than about 1 N, at most
    5 mm/s; 0.5 mm/s on a sine surface, which is then met near its turning point."""
    friction: float = with_default(SceneOptions, "friction", 0.3)
    spin_length: float = with_default(SceneOptions, "spin_length", 0.004)
    robot: str = with_default(SceneOptions, "robot", "stage")
    out: Path = Path("runs/regulate")

    def __post_init__(self) -> None:
        check_options(self)
        check_change_names(self.change, LIVE)
        if self.axis and not (len(self.axis) == 3 and 0.0 < math.hypot(*self.axis) < math.inf):
            raise InvalidValueError(f"axis = {self.axis}: give three numbers that are not all 0")
        self._check_surface()
        self._check_profile()
        self._check_motion()

    def _check_surface(self) -> None:
        if self.object == "scene" and self.file is None:
            raise InvalidValueError("object = scene: a file must describe it (--file)")
        if self.object == "scene" and self.surface != "still":
            raise InvalidValueError(
                f"surface = {self.surface}: is for a plate or sphere; what a scene does stands in its file, as "
                "joints with stiffness and damping: leave it still"
            )
        if self.surface == "leaving" and self.surface_speed > _FASTEST_LEAVING:
            raise InvalidValueError(
                f"surface_speed = {self.surface_speed:g} m/s: must be at most {_FASTEST_LEAVING:g} m/s"
                f"{speed_hint(self.surface_speed, _FASTEST_LEAVING)}"
            )

    def _check_profile(self) -> None:
        if self.greatest > MAX_FORCE:
            left_out = " (swing: left out, half of it)" if self.swing is None else ""
            raise InvalidValueError(
                f"force = {self.force:g} N and swing = {self.swung:g} N{left_out}: together at most "
                f"{MAX_FORCE:g} N"
            )
        if self.profile == "sine" and self.swung >= self.force:
            raise InvalidValueError(
                f"swing = {self.swung:g} N: must be less than the force of {self.force:g} N, or the tip would "
                "have to pull"
            )
        if not self.frequencies:
            raise InvalidValueError("frequencies: there are none; give one at least [Hz]")
        if self.profile == "step" and self.duration < 2.0 * self.hold:
            raise InvalidValueError(
                f"duration = {self.duration:g} s: must be at least twice the hold of {self.hold:g} s, or nothing "
                "steps"
            )

    def _check_motion(self) -> None:
        if self.motion in FROM_FILES and self.motion_file is None:
            raise InvalidValueError(f"motion = {self.motion}: needs a file (--motion-file)")

    @property
    def thing(self) -> str:
        """Name of the object, for sentences."""
        return f"{self.touch or 'scene'} of {self.file.name}" if self.file is not None else f"a {self.object}"

    @property
    def described(self) -> str:
        """Name of the object with the behaviour of its surface, for sentences."""
        return self.thing if self.file is not None else f"a {self.surface} {self.object}"

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
        """Stiffness of the simulated contact [N/m]."""
        if self.stiffness is not None:
            return self.stiffness
        return _SOFT_STIFFNESS if self.surface == "soft" else STIFFNESS
