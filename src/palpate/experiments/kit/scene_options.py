"""Options that experiments share, each defined once with unit, bounds and check; imports nothing heavy.

A `Config` inherits the groups that it needs, and gives an option another default by `with_default`.
"""

from dataclasses import dataclass
from pathlib import Path

from palpate.experiments.kit.checks import (
    check_force_noise,
    check_friction,
    check_period,
    check_spin_length,
    check_tip,
)
from palpate.experiments.kit.options import CHANGED, NOISY, PERIODIC, TOUCHED, option


@dataclass(frozen=True)
class SceneOptions:
    """Options of every experiment: simulated friction, noise, and who carries out what."""

    friction: float | None = option(0.3, fixed=TOUCHED, symbol="mu", check=check_friction)
    """Friction coefficient between fingertip and object, of the simulation."""
    spin_length: float | None = option(0.004, "m", fixed=TOUCHED, symbol="e", check=check_spin_length)
    """Largest spin torque per largest friction force of that contact [m]."""
    force_noise: float | None = option(None, "N", fixed=NOISY, check=check_force_noise)
    """Standard deviation of the sensor's force noise [N], each axis. Left out: the robot file's."""
    moment_noise: float | None = option(None, "N m", fixed=NOISY, bound="not negative")
    """Standard deviation of the sensor's moment noise [N m], each axis. Left out: the robot file's."""
    seed: int = 0
    """Seed of the noise: the same seed gives the same run."""
    robot: str | None = option("stage")
    """Robot that carries the fingertip: one that comes with palpate (`palpate robot list`), or a robot file."""
    out: Path = Path("runs")
    """Folder for the report and the log."""


@dataclass(frozen=True)
class ContactOptions(SceneOptions):
    """Options of experiments that touch with one fingertip."""

    stiffness: float | None = option(20e3, "N/m", bound="positive")
    """Stiffness of the contact, tip and object together [N/m]."""


@dataclass(frozen=True)
class FingerOptions(ContactOptions):
    """Options that take the place of values in the robot file."""

    tip: tuple[float, ...] = option((), "m", check=check_tip)
    """Fingertip [m]: one number for the radius of a sphere, three for the semi-axes of an ellipsoid. Left out: the
    robot file's."""
    period: float | None = option(None, "s", fixed=PERIODIC, check=check_period)
    """Control period [s]. Left out: the robot file's."""


@dataclass(frozen=True)
class PressingOptions(FingerOptions):
    """Options of experiments that hold a force on an object, which may be a part of a scene."""

    file: Path | None = option(None, fixed=TOUCHED)
    """File that describes the object."""
    touch: str = option("", fixed=TOUCHED, of=("object", ("scene",)))
    """scene: the geom to touch, or a body with one geom that collides. Left out: the only such geom there is."""
    force: float = option(2.0, "N")
    """Normal force to hold [N]."""
    identify: bool = option(False, fixed="the log keeps what pressing has found")
    """Press first, for half a minute, to find stiffness and delay of contact and robot, and compute the gain from
    them. A surface that moves stands still meanwhile. Left out: the gain follows from the stiffness that is given
    and from the robot file."""
    change: tuple[tuple[float, str, float], ...] = option((), fixed=CHANGED, once=True)
    """Change force [N], force_gain [m/s/N] or, of an exploration, speed [m/s] during the run: seconds after the
    start, name, new value, as in --change 5 force 3. The start is that of the run. A change during approach or
    landing takes effect at once. A force profile moves with the force. The change is ramped, so that nothing
    jumps."""


@dataclass(frozen=True)
class ObjectOptions:
    """Options of a simulated object with a name and a size."""

    object: str = option("", fixed=TOUCHED)
    """Object that is touched."""
    size: tuple[float, ...] = option((), "m", fixed=TOUCHED)
    """Size of the object [m]."""


@dataclass(frozen=True)
class DriftOptions:
    """Options of a sensor whose zero drifts."""

    drift: float = option(0.0, "N/min", fixed=NOISY, bound="not negative")
    """Drift of the sensor's zero along its z [N/min]."""


@dataclass(frozen=True)
class LimitSurfaceOptions:
    """Options of simulated friction that is no ellipse of constant size."""

    norm_exponent: float | None = option(None, fixed=TOUCHED, bound="positive", symbol="p")
    """True p of the simulated surface: how force and torque share, 2 (ellipse) to 1 (diamond). Left out: 2."""
    load_exponent: float | None = option(None, fixed=TOUCHED, bound="not negative", symbol="gamma")
    """True gamma of the simulated surface: e grows as load^gamma, 0 to 1/3. Left out: 0."""
