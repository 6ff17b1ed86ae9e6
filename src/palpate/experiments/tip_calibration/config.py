"""The options of a tip calibration; imports nothing heavy, so that `palpate --help` is quick."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from palpate.errors import InvalidValueError
from palpate.experiments.kit.checks import MAX_FORCE, check_length, check_seed
from palpate.experiments.kit.options import TOUCHED, check_options, option, own_first, with_default
from palpate.experiments.kit.scene_options import ContactOptions, SceneOptions

_ShapeName = Literal["sphere", "ellipsoid", "capsule", "superellipsoid"]
_Triple = tuple[float, float, float]

TOUCHES_TEXT = "touches.csv"
"""Under this name a log keeps the touches of a file, or those that came first."""

FEWEST, _MOST = 20, 200
"""Touches: those that come first are 17; more take an hour."""

LARGEST_ERROR = 0.3
"""Relative, of a fingertip's size, that is simulated."""


@own_first
@dataclass(frozen=True)
class TipCalibrationConfig(ContactOptions):
    """Calibrate a fingertip by touching a plate, a rod and a ball, of which only the radii are known.

    Size, centre and orientation of the tip in the sensor frame, and the stiffness of the contact, are found from
    wrenches and poses at rest, each with its standard deviation; what these touches do not tell is said, and so is
    every assumption that does not hold. First come a few touches where the things are thought to be, then those
    that tell most. The report shows the tip found beside the typed one; robot.yaml is the robot file with it.

    With --touches nothing moves: touches of a file are evaluated, as from a finger guided by hand. With --plan
    nothing moves either: the touches that would tell most are written to next_touches.csv.

    All values are in SI units: metres, newtons, radians.

    Example, in simulation, with a tip that is not as its file says: palpate calibrate tip --unknown-tip 1

    Example, touches by hand: palpate calibrate tip --robot cell.yaml --touches touches.csv

    Example, which touches to make: palpate calibrate tip --robot cell.yaml --plan
    """

    touches: Path | None = option(None, fixed="the log keeps them", kept=TOUCHES_TEXT)
    """CSV of touches to evaluate: target (its name), kind (point, line or plane), radius_m; the sensor's pose
    x_m, y_m, z_m and qw, qx, qy, qz; fx_N ... mz_Nm, what is felt less what was felt in the air; and, if known,
    time_s, where the thing is about (place_x_m ... direction_z) and standard deviations (sd_fx_N ...)."""
    plan: bool = option(False, fixed=TOUCHED)
    """Move nothing: write which touches would tell most, after those of --touches, if there are any."""
    shape: _ShapeName | None = option(None)
    """Family of shapes to which the tip belongs. Left out: as in the robot file."""
    touch_count: int = option(60, fixed=TOUCHED, within=(FEWEST, _MOST))
    """How many touches are made, those that come first included."""
    forces: tuple[float, ...] = option(
        (1.0, 3.0), "N", fixed=TOUCHED, bound="positive", within=(-math.inf, MAX_FORCE)
    )
    """Forces of each touch, one after the other [N]: two or more determine the stiffness."""
    plate: _Triple = option((-0.045, 0.0, 0.0), "m", fixed=TOUCHED)
    """About where the plate's upper side has its middle, base frame [m]."""
    rod: _Triple = option((0.03, -0.04, 0.04), "m", fixed=TOUCHED)
    """About where the middle of the rod's axis, or of an edge, is, base frame [m]."""
    rod_direction: _Triple = option((1.0, 0.0, 0.0), fixed=TOUCHED)
    """Direction of the rod, base frame."""
    ball: _Triple = option((0.03, 0.04, 0.04), "m", fixed=TOUCHED)
    """About where the middle of the ball, or the point of a needle, is, base frame [m]."""
    radii: tuple[float, float] = option((0.002, 0.002), "m", fixed=TOUCHED, bound="not negative")
    """Radii of rod and ball [m], as a caliper reads them; 0 for a sharp edge or a needle."""
    place_sd: float = option(2e-3, "m", fixed=TOUCHED, bound="positive")
    """How well these places are known, standard deviation [m]. They are looked for three times as far."""
    stiffness: float = with_default(ContactOptions, "stiffness", 20e3)
    """Stiffness of the contact, tip and object together, as it is taken for [N/m]."""
    exponent_sd: float = option(0.0, bound="not negative")
    """How wrong the exponent of the skin's law may be that the robot file has, or 1: standard deviation. 0: it is
    known. Three forces or more tell it."""
    deviations: int = option(0)
    """Highest degree of a field of small deviations from a sphere that is sought besides: 2, 3, or 0 for none."""
    mount_turn_sd: float = option(0.0, "rad", bound="not negative")
    """How wrong the sensor's orientation on the flange may be, about each axis, standard deviation [rad]: it is
    sought, too, by a robot that turns its tip. 0: it is known."""
    mount_shift_sd: float = option(0.0, "m", bound="not negative")
    """How wrong the sensor's place on the flange may be, along each axis, standard deviation [m]. 0: it
    is known."""
    unknown_tip: int | None = option(None, fixed=TOUCHED, check=check_seed)
    """Simulate a tip that differs from the robot file by errors that this seed draws: size within 5 %, centre
    within 1 mm along each axis, tilt of 3 degrees, stiffness half to twice. Simulation only, as the next ones."""
    size_error: float = option(0.0, fixed=TOUCHED, within=(-LARGEST_ERROR, LARGEST_ERROR), remark="; 0.05 is 5 %")
    """How much larger the simulated tip is than typed, relative."""
    center_error: _Triple = option((0.0, 0.0, 0.0), "m", fixed=TOUCHED)
    """By how much its centre is elsewhere, sensor frame [m]."""
    stiffness_ratio: float = option(1.0, fixed=TOUCHED, bound="positive")
    """How many times as stiff the simulated contact is as it is taken for."""
    scene_error: int = option(0, fixed=TOUCHED, check=check_seed)
    """Seed that draws how far the simulated things are from where they are thought to be: up to 1.5 mm along each
    axis, and tilted by up to 2 degrees."""
    friction: float = with_default(SceneOptions, "friction", 0.4)
    spin_length: float = with_default(SceneOptions, "spin_length", 0.002)
    robot: str = with_default(SceneOptions, "robot", "turning-stage-nano17")
    out: Path = Path("runs/calibrate-tip")
    """Folder for the report, the log, touches.csv, next_touches.csv, tip.yaml and robot.yaml."""

    def __post_init__(self) -> None:
        check_options(self)
        if not self.forces:
            raise InvalidValueError("forces: there are none; give one at least [N]")
        if not 0.0 < math.hypot(*self.rod_direction) < math.inf:
            raise InvalidValueError(f"rod_direction = {self.rod_direction}: give three numbers, not all 0")
        for radius in self.radii:
            check_length("radii", radius or 1e-3, 0.1)
        check_length("place_sd", self.place_sd, 0.01)
        check_length("center_error", max(math.hypot(*self.center_error), 1e-9), 0.01)

    @property
    def tip_is_other(self) -> bool:
        """Whether a tip is to be simulated that differs from the robot file."""
        changed = (self.size_error, *self.center_error, self.stiffness_ratio - 1.0)
        return self.unknown_tip is not None or any(changed)

    @property
    def moves(self) -> bool:
        """Whether anything is touched."""
        return self.touches is None and not self.plan
