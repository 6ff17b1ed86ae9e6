"""Checks of options, of requested forces, speeds and changes, and of output files; imports nothing heavy.

An error names the option with its value, the bound, and the remedy.
"""

import math
import os
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING

from palpate.errors import InvalidValueError, not_negative, positive
from palpate.nearest_name import nearest

if TYPE_CHECKING:
    from palpate.runtime import Limits
    from palpate.runtime.live import LiveParameters

_MAX_LENGTH = 2.0
"""Largest length of object, fingertip and raster [m]: robots reach 1 m in each direction."""

_MAX_PERIOD = 8e-3
"""Longest control period [s]: at 125 Hz a stage explores as well as at 1 kHz; at lower rates, it lands hard."""

MAX_SEED = 2**63 - 1
"""Largest whole number that a configuration file keeps exactly."""

_MAX_FRICTION = 10.0
"""Largest simulated friction coefficient, as in friction files and libraries."""

_MAX_SPIN_LENGTH = 0.1
"""Largest simulated spin length [m]."""

MIN_TOUCH_FORCE = 0.2
"""Smallest touch threshold [N]; noise may raise the threshold."""

TOUCH_DEVIATIONS = 7.0
"""Touch threshold in standard deviations of the force noise of one axis: the norm of the noise's three components
exceeds the threshold once in 1e10 samples."""

MIN_FORCE_PER_TOUCH_FORCE = 1.5
"""Smallest set force over the touch threshold."""

MAX_FORCE = 15.0
"""Largest set force [N]: beyond it, landing could reach the supervisor's limit of 20 N."""

_LANDING_SHARE = 0.75
"""Largest set force over the robot's force limit: landing may exceed the set force."""

_SOFT_STIFFNESS = 1e3
"""Stiffness below which another unit was probably meant [N/m]: that of `palpate regulate --surface soft`."""

_ROUNDING = 1e-12
"""Relative rounding error that a bound allows."""


def check_within(name: str, value: float, within: tuple[float, float], unit: str, remark: str = "") -> None:
    """Refuse a number outside its bounds.

    Args:
        name: Name of the option.
        value: Number to check.
        within: Smallest and largest allowed number; the smallest may be -infinity, the largest infinity.
        unit: Unit of both.
        remark: End of the message, after the bounds.

    Raises:
        InvalidValueError: If the number lies outside.
    """
    if within[0] <= value <= within[1]:
        return
    number, least, most = (f"{each:g}" if isinstance(each, float) else str(each) for each in (value, *within))
    bounds = f"from {least} to {most}"
    if within[0] == -math.inf:
        bounds = f"at most {most}"
    elif within[1] == math.inf:
        bounds = f"at least {least}"
    given, allowed = f"{name} = {number} {unit}".rstrip(), f"must be {bounds} {unit}".rstrip()
    raise InvalidValueError(f"{given}: {allowed}{remark}")


def check_length(name: str, length: float, largest: float = _MAX_LENGTH) -> None:
    """Refuse a length [m] that is not positive, or larger than `largest` [m].

    Raises:
        InvalidValueError: If the length is out of bounds.
    """
    if positive(name, length, "m") > largest:
        hint = f"; for {length:g} mm give {length / 1e3:g}" if length <= 1e3 * largest else ""
        raise InvalidValueError(f"{name} = {length:g} m: must be at most {largest:g} m{hint}")


def spaced(numbers: tuple[float, ...]) -> str:
    """Return numbers as typed on the command line."""
    return " ".join(f"{number:g}" for number in numbers)


def speed_hint(speed: float, fastest: float) -> str:
    """Return a hint for a speed [m/s] above the `fastest` one that may have been typed in mm/s; else ""."""
    return f"; for {speed:g} mm/s give {speed / 1e3:g}" if 1.0 <= speed <= 1e3 * fastest else ""


def check_size(thing: str, size: tuple[float, ...], example: tuple[float, ...]) -> None:
    """Refuse a size of a simulated object that is neither empty nor as many lengths [m] as the example.

    Raises:
        InvalidValueError: If the number of lengths differs, or a length is out of bounds.
    """
    if len(size) not in (0, len(example)):
        raise InvalidValueError(
            f"size: {len(size)} numbers; a {thing} takes {len(example)} [m], for example {spaced(example)}"
        )
    for length in size:
        check_length("size", length)


def check_tip(name: str, tip: tuple[float, ...]) -> None:
    """Refuse a fingertip that is neither a radius, nor three semi-axes [m], nor empty (as in the robot file).

    Raises:
        InvalidValueError: If the number of lengths differs, or a length is out of bounds.
    """
    if len(tip) not in (0, 1, 3):
        raise InvalidValueError(
            f"{name} = {spaced(tip)}: give one number (radius of a sphere) or three (semi-axes) [m]"
        )
    for length in tip:
        check_length(name, length)


def check_seed(name: str, seed: int) -> None:
    """Refuse a seed that no random generator or no file takes.

    Raises:
        InvalidValueError: If the seed is out of bounds.
    """
    if not 0 <= seed <= MAX_SEED:
        raise InvalidValueError(f"{name} = {seed}: must be a whole number from 0 to {MAX_SEED}")


def check_period(name: str, period: float) -> None:
    """Refuse a control period [s] that is too long for touch.

    Raises:
        InvalidValueError: If the period is out of bounds.
    """
    if positive(name, period, "s") > _MAX_PERIOD:
        raise InvalidValueError(f"{name} = {period:g} s: must be at most {_MAX_PERIOD:g} s")


def check_friction(name: str, friction: float) -> None:
    """Refuse a friction coefficient that no surface has, or that is in per cent.

    Raises:
        InvalidValueError: If the coefficient is out of bounds.
    """
    if positive(name, friction, "") > _MAX_FRICTION:
        hint = f"; for {friction:g} % give {friction / 100.0:g}" if friction <= 100.0 * _MAX_FRICTION else ""
        raise InvalidValueError(f"{name} = {friction:g}: must be at most {_MAX_FRICTION:g}{hint}")


def check_spin_length(name: str, spin_length: float) -> None:
    """Refuse a spin length [m] that no contact has, or that is in millimetres.

    Raises:
        InvalidValueError: If the length is out of bounds.
    """
    check_length(name, spin_length, _MAX_SPIN_LENGTH)


def check_force_noise(name: str, noise: float) -> None:
    """Refuse a force noise [N] in which no touch can be detected, or that is in another unit.

    Raises:
        InvalidValueError: If the noise is negative or too large.
    """
    if MIN_FORCE_PER_TOUCH_FORCE * TOUCH_DEVIATIONS * not_negative(name, noise, "N") > MAX_FORCE:
        raise InvalidValueError(
            f"{name} = {noise:g} N: too large to detect a touch within {MAX_FORCE:g} N; for {noise:g} mN "
            f"give {noise / 1e3:g}"
        )


def check_compression(tip: Sequence[float], force: float, stiffness: float) -> None:
    """Refuse a fingertip that is compressed by more than its radius; the tip takes half of the compression.

    Args:
        tip: Radius or semi-axes [m].
        force: Largest normal force [N].
        stiffness: Stiffness of the contact [N/m].

    Raises:
        InvalidValueError: If the compression is too large.
    """
    compression = 0.5 * force / stiffness
    if min(tip) <= compression:
        hint = f"; is the stiffness in another unit? For {stiffness:g} kN/m give --stiffness {1e3 * stiffness:g}"
        raise InvalidValueError(
            f"tip = {min(tip):g} m: must be larger than its compression at {force:g} N and {stiffness:g} N/m, "
            f"{compression:.2g} m{hint if stiffness < _SOFT_STIFFNESS else ''}"
        )


def max_set_force(limits: "Limits") -> float:
    """Return the largest set force for a robot's limits [N]."""
    return min(MAX_FORCE, _LANDING_SHARE * limits.force)


def check_force(force: float, greatest: float, limits: "Limits") -> None:
    """Refuse a set force with which landing could exceed the robot's force limit.

    Args:
        force: Requested force [N].
        greatest: Largest force of the profile about it [N].
        limits: Limits of the robot.

    Raises:
        InvalidValueError: If the limit could be exceeded.
    """
    most = _LANDING_SHARE * limits.force
    if greatest > most * (1.0 + _ROUNDING):
        goes = "" if greatest == force else f"the profile goes up to {greatest:g} N and "
        raise InvalidValueError(
            f"force = {force:g} N: {goes}must be at most {most:g} N, {_LANDING_SHARE:.0%} of the robot's limit of "
            f"{limits.force:g} N (limits.force_N in the robot file), for landing may exceed it"
        )


def check_least_force(option: str, least: float, touch_force: float, remedy: str) -> None:
    """Refuse a set force that is not reliably a touch.

    Args:
        option: Option with its value, begin of the message.
        least: Smallest set force [N].
        touch_force: Touch threshold of the robot's sensor [N].
        remedy: End of the message.

    Raises:
        InvalidValueError: If the force is too small.
    """
    bound = MIN_FORCE_PER_TOUCH_FORCE * touch_force
    if least < bound * (1.0 - _ROUNDING):
        raise InvalidValueError(
            f"{option} must be at least {bound:.6g} N, {MIN_FORCE_PER_TOUCH_FORCE:g} times the touch threshold of "
            f"the robot's sensor; {remedy}"
        )


def check_speed(name: str, speed: float, limits: "Limits") -> None:
    """Refuse a speed [m/s] beyond the robot's limit.

    Raises:
        InvalidValueError: If the speed is too large.
    """
    if speed > limits.speed:
        raise InvalidValueError(
            f"{name} = {speed:g} m/s: must be at most the robot's limit, {limits.speed:g} m/s "
            "(limits.speed_m_per_s in the robot file)"
        )


def check_acceleration(name: str, acceleration: float, limits: "Limits", remedy: str) -> None:
    """Refuse a planned acceleration [m/s^2] at which the supervisor would stop the run.

    Raises:
        InvalidValueError: If the acceleration exceeds the robot's limit; the message ends with `remedy`.
    """
    if acceleration > limits.acceleration * (1.0 + _ROUNDING):
        raise InvalidValueError(
            f"{name} = {acceleration:.4g} m/s^2: must be at most the robot's limit, {limits.acceleration:g} m/s^2 "
            f"(limits.acceleration_m_per_s2 in the robot file); {remedy}"
        )


def check_change_names(changes: Sequence[tuple[float, str, float]], known: Sequence[str]) -> None:
    """Refuse changes of live parameters at impossible times or with unknown names.

    Args:
        changes: Seconds after the start, name, new value.
        known: Names of the live parameters.

    Raises:
        InvalidValueError: If a time is negative or a name unknown.
    """
    for time, name, _ in changes:
        not_negative(f"change of {name}", time, "s after the start")
        if name not in known:
            near = nearest(name, known)
            advice = f"did you mean {near}?" if near else f"known are {', '.join(known)}"
            raise InvalidValueError(f"change after {time:g} s: no live parameter is called {name!r}; {advice}")


def check_changes(changes: Sequence[tuple[float, str, float]], live: "LiveParameters") -> None:
    """Refuse changes (as in `check_change_names`) that are out of the bounds of the live parameters.

    Raises:
        InvalidValueError: If a value is out of bounds.
    """
    for time, name, value in changes:
        try:
            live.check(name, value)
        except InvalidValueError as error:
            raise InvalidValueError(f"change after {time:g} s: {error}") from None


def make_folder(folder: Path) -> None:
    """Make a folder before the work, so that no result is lost.

    Raises:
        InvalidValueError: If the folder cannot be made or written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=folder):  # with a unique name, or without one
            pass
    except OSError as error:
        raise InvalidValueError(f"out = {folder}: {error.strerror}; choose another folder (--out)") from None


def check_folder(folder: Path) -> None:
    """Check that `make_folder` could make a folder, without making it.

    Raises:
        InvalidValueError: If the folder cannot be made or written.
    """
    present = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if not present.is_dir():
        raise InvalidValueError(f"out = {folder}: {present} is no folder; choose another folder (--out)")
    if not os.access(present, os.W_OK | os.X_OK):
        raise InvalidValueError(f"out = {folder}: {present} cannot be written; choose another folder (--out)")


def check_file(file: Path, option: str | None = "out") -> None:
    """Check that a file can be written, without writing it.

    Args:
        file: Path of the file.
        option: Option that names another file; None for a file without one.

    Raises:
        InvalidValueError: If the file cannot be written.
    """
    name, typed = ("file", "") if option is None else (option, f" (--{option})")
    folder = file.parent
    if not folder.exists():
        raise InvalidValueError(f"{name} = {file}: there is no such folder; make it, or choose another{typed}")
    if not folder.is_dir():
        raise InvalidValueError(f"{name} = {file}: {folder} is no folder; choose another{typed}")
    if file.is_dir():
        raise InvalidValueError(f"{name} = {file}: is a folder; name a file in it{typed}")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InvalidValueError(f"{name} = {file}: {folder} cannot be written; choose another folder{typed}")
