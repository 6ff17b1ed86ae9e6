"""friction.yaml: the friction measured on a surface, as later grasps use it."""

import math
import os
from enum import StrEnum
from pathlib import Path

import msgspec

from palpate.errors import InvalidValueError, positive
from palpate.estimation import BrokenAssumption
from palpate.friction.limit_surface import LimitSurface
from palpate.strict_decode import decode_file, load
from palpate.yaml_text import yaml_text

VERSION = 1
"""Of the file."""

LARGEST_FRICTION, LARGEST_LENGTH = 10.0, 0.1
"""Beyond any fingertip: a spin length above 0.1 m is a number in millimetres."""


class How(StrEnum):
    """Where a number comes from."""

    MEASURED = "measured"
    """It slipped: value and 95 % interval are what was seen."""
    BOUND = "bound"
    """It is at least that: `value` and `lower` are the largest that was borne or felt, there is no upper end."""
    ASSUMED = "assumed"
    """Nobody has measured it: the usual value and its range."""


class FrictionEstimate(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A number, how far it may be off, and where it comes from."""

    value: float
    lower: float
    upper: float
    how: How

    def __post_init__(self) -> None:
        if not (math.isfinite(self.value) and self.lower <= self.value <= self.upper):
            raise InvalidValueError(
                f"value = {self.value:g} in [{self.lower:g}, {self.upper:g}]: must be a number within its interval"
            )

    @property
    def measured(self) -> bool:
        """Whether it was, not bounded or assumed."""
        return self.how is How.MEASURED


class LoadFinding(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What was found at one load."""

    normal_force: float = msgspec.field(name="normal_force_N")
    friction: FrictionEstimate
    spin_length: FrictionEstimate | None = msgspec.field(name="spin_length_m", default=None)
    torque_ratio: FrictionEstimate | None = msgspec.field(name="torque_ratio_m", default=None)


class SpeedFinding(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What was found at one slip speed."""

    speed: float = msgspec.field(name="speed_m_per_s")
    friction: FrictionEstimate
    creeping: bool = False


class FrictionFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What was found of a surface.

    Attributes:
        palpate_friction: Version of the file.
        provenance: Where and how it was found.
        friction: mu in slip, at `speed`.
        speed: Of the slip that mu belongs to [m/s].
        spin_length: c, e at 1 N [m]; None if nothing is known of spinning.
        load_exponent: gamma.
        norm_exponent: p.
        static_friction: mu at which slip begins, where it is another than `friction`; a bound where mu still rose
            at the slowest speed.
        loads: What was found at each load: what lies beyond the least and the largest nobody has rubbed.
        speeds: And at each speed, of one load.
        broken: Assumptions that did not hold; none: numbers and intervals can be used.
    """

    palpate_friction: int
    provenance: str
    friction: FrictionEstimate
    speed: float = msgspec.field(name="speed_m_per_s")
    spin_length: FrictionEstimate | None = msgspec.field(name="spin_length_m")
    load_exponent: FrictionEstimate
    norm_exponent: FrictionEstimate
    static_friction: FrictionEstimate | None = None
    loads: tuple[LoadFinding, ...] = ()
    speeds: tuple[SpeedFinding, ...] = ()
    broken: tuple[BrokenAssumption, ...] = ()

    def __post_init__(self) -> None:
        if not 0.0 < self.friction.value <= LARGEST_FRICTION:
            raise InvalidValueError(
                f"friction = {self.friction.value:g}: must be above 0 and at most {LARGEST_FRICTION:g}"
            )
        if self.spin_length is not None and not 0.0 < self.spin_length.value <= LARGEST_LENGTH:
            raise InvalidValueError(
                f"spin_length_m = {self.spin_length.value:g}: must be above 0 and at most {LARGEST_LENGTH:g}; "
                "metres are meant"
            )
        positive("speed_m_per_s", self.speed, "m/s")
        if self.spin_length is not None:
            self.limit_surface()  # refuses exponents that cannot be

    @property
    def spun_loads(self) -> tuple[float, float] | None:
        """Least and largest normal force at which e was measured [N]: beyond, its growth is a guess."""
        spun = [
            load.normal_force for load in self.loads if load.spin_length is not None and load.spin_length.measured
        ]
        return (min(spun), max(spun)) if spun else None

    def limit_surface(self) -> LimitSurface:
        """Return what the contact bears, as far as it is known.

        Raises:
            InvalidValueError: Nothing is known of spinning.
        """
        if self.spin_length is None:
            if any(load.torque_ratio is not None for load in self.loads):
                raise InvalidValueError(
                    "spin_length_m: not known, for the finger turned, but did not slip both along the surface and "
                    "about its normal; rub again with lighter loads, or farther (palpate friction --loads, "
                    "--most-travel)"
                )
            raise InvalidValueError(
                "spin_length_m: not known, for the finger did not turn on the surface; rub with a robot that "
                "turns its tip (palpate friction --robot turning-stage)"
            )
        return LimitSurface(
            self.friction.value, self.spin_length.value, self.load_exponent.value, self.norm_exponent.value
        )


def friction_file_text(found: FrictionFile) -> str:
    """Return it as YAML; `read_friction_file` gives back the very same."""
    comments = {
        "friction": "mu: tangential over normal force in slip; 95 % intervals",
        "spin_length_m": "e at 1 N: spin torque over mu f_n in spinning slip",
        "load_exponent": "gamma: e grows as (f_n / 1 N)^gamma",
        "norm_exponent": "p: |(f_t / mu f_n, tau / mu e f_n)|_p = 1",
    }
    built: dict[str, object] = msgspec.to_builtins(found)
    text = yaml_text(built)
    # a note stands above what takes several lines
    lines = []
    for line in text.splitlines():
        key = line.partition(":")[0]
        if key in comments:
            lines.append(f"# {comments[key]}")
        lines.append(line)
    return "\n".join([*lines, ""])


def read_friction_file(text: str) -> FrictionFile:
    """Return what the text of a friction file says.

    Raises:
        InvalidValueError: A key is misspelt, a value of the wrong type or impossible; the message says where.
    """
    return decode_file(text, FrictionFile, "friction file", "palpate_friction", VERSION)


def load_friction_file(path: str | os.PathLike[str]) -> FrictionFile:
    """Return what a friction file says.

    Raises:
        InvalidValueError: As in `read_friction_file`, or the file cannot be read; the message names it.
    """
    try:
        return load(Path(path), read_friction_file, "a friction file")
    except OSError as error:
        raise InvalidValueError(f"friction file {path}: cannot be read: {error.strerror}") from None
