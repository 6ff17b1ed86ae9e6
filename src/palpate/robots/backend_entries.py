"""Back ends in robot files: what `backend` may be.

Plain data. What a kind of robot is made of, `palpate.sim` and `palpate.hw` know; experiments bring the two
together (`palpate.robots.in_scene`). A new kind is one more entry here and one more builder there.
"""

import ipaddress
from typing import Annotated

import msgspec

from palpate.errors import InvalidValueError
from palpate.robots.rig_entries import RigEntry
from palpate.runtime.robot_ranges import within

RANGES = {
    "mass_kg": (1e-3, 1000.0, "kg"),
    "bandwidth_rad_per_s": (0.1, 1e4, "rad/s"),
    "following_error_m": (1e-6, 0.1, "m"),
    "angular_following_error_rad": (1e-5, 1.5, "rad"),
    "inertia_kg_m2": (1e-6, 100.0, "kg m^2"),
    "time_step_s": (1e-6, 0.01, "s"),
    "robot_base_distance_m": (0.0, 2.0, "m"),
    "tool_length_m": (0.0, 1.0, "m"),
    "time_scale": (0.01, 10.0, ""),
}
"""What a robot can be, generously: beyond, the number is in another unit (grams, hertz, millimetres, ms)."""


def loopback_address(key: str, address: str) -> str:
    """Return an address that nobody but this computer reaches.

    Raises:
        InvalidValueError: It is none.
    """
    try:
        inside = ipaddress.IPv4Address(address).is_loopback
    except ValueError:
        inside = False
    if not inside:
        raise InvalidValueError(
            f"{key} = {address!r}: must be an address of this computer's own net, 127.0.0.1 to 127.255.255.254"
        )
    return address


class _Within(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Numbers within `RANGES`."""

    def __post_init__(self) -> None:
        for field in msgspec.structs.fields(self):
            value = getattr(self, field.name)
            if not isinstance(value, str):
                least, most, unit = RANGES[field.encode_name]
                within(field.encode_name, value, least, most, unit)


class StageEntry(_Within, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="stage"):
    """The simulated three-axis stage: see `palpate.sim.carriers.stage.Stage`.

    Attributes:
        mass: Moving mass without the tip [kg].
        bandwidth: Natural frequency of its servos [rad/s].
        following_error_limit: Largest distance of the servos' reference from the actual position [m].
        time_step: Of the simulation [s]; the control period is a whole number of them.
    """

    mass: float = msgspec.field(name="mass_kg")
    bandwidth: float = msgspec.field(name="bandwidth_rad_per_s")
    following_error_limit: float = msgspec.field(name="following_error_m")
    time_step: float = msgspec.field(name="time_step_s")


class TurningStageEntry(
    _Within, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="turning_stage"
):
    """The simulated stage that also turns: see `palpate.sim.carriers.turning_stage.TurningStage`.

    Attributes:
        mass: Moving mass without the tip [kg].
        inertia: Of what turns, without the tip, about every axis [kg m^2].
        bandwidth: Natural frequency of its servos [rad/s].
        following_error_limit: Largest distance of the servos' reference from the actual position [m].
        angular_following_error: Likewise, of its orientation [rad].
        time_step: Of the simulation [s]; the control period is a whole number of them.
    """

    mass: float = msgspec.field(name="mass_kg", default=5.0)
    inertia: float = msgspec.field(name="inertia_kg_m2", default=0.01)
    bandwidth: float = msgspec.field(name="bandwidth_rad_per_s", default=100.0)
    following_error_limit: float = msgspec.field(name="following_error_m", default=0.0025)
    angular_following_error: float = msgspec.field(name="angular_following_error_rad", default=0.06)
    time_step: float = msgspec.field(name="time_step_s", default=0.0005)


class SimulatedUr5eEntry(
    _Within, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="simulated_ur5e"
):
    """A simulated Universal Robots UR5e that starts with its tip upright: see `palpate.sim.ArmCarrier`.

    Attributes:
        robot_base_distance: From its robot base, behind the origin of the base frame, to the origin [m].
        tool_length: From its flange to the tip frame [m].
        bandwidth: Natural frequency of its servos [rad/s].
        following_error_limit: Largest distance of the reference from the actual position of the tip [m].
        time_step: Of the simulation [s]; the control period is a whole number of them.
    """

    robot_base_distance: float = msgspec.field(name="robot_base_distance_m", default=0.45)
    tool_length: float = msgspec.field(name="tool_length_m", default=0.1)
    bandwidth: float = msgspec.field(name="bandwidth_rad_per_s", default=100.0)
    following_error_limit: float = msgspec.field(name="following_error_m", default=0.001)
    time_step: float = msgspec.field(name="time_step_s", default=0.0005)


class EmulatedUr5eEntry(
    _Within, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="emulated_ur5e"
):
    """The simulated UR5e behind an emulated controller and F/T box, run over the real wires and client libraries.

    Attributes:
        address: Where controller and F/T box listen: one of the loopback net, for ports are fixed.
        time_scale: Seconds of the robot per second of wall time: less where the computer is too busy for 1.
        robot_base_distance: As of `SimulatedUr5eEntry`, and so on [m].
        tool_length: [m].
        bandwidth: [rad/s].
        following_error_limit: [m].
        time_step: [s]; the controller's cycle of 2 ms is a whole number of them.
    """

    address: str = "127.0.0.2"
    time_scale: float = 1.0
    robot_base_distance: float = msgspec.field(name="robot_base_distance_m", default=0.45)
    tool_length: float = msgspec.field(name="tool_length_m", default=0.1)
    bandwidth: float = msgspec.field(name="bandwidth_rad_per_s", default=100.0)
    following_error_limit: float = msgspec.field(name="following_error_m", default=0.001)
    time_step: float = msgspec.field(name="time_step_s", default=0.0005)

    def __post_init__(self) -> None:
        super().__post_init__()
        loopback_address("address", self.address)


class EmulatedHandEntry(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="emulated_hand"
):
    """The simulated hand behind an emulated bus of servos, F/T boxes, and an emulated UR controller that lifts it.

    Attributes:
        address: Where the controller listens: one of the loopback net, for ports are fixed.
        sensors: Of the F/T boxes, one per finger, likewise.
        time_scale: Seconds of the hand per second of wall time: less where the computer is too busy for 1.
    """

    address: str = "127.0.0.2"
    sensors: Annotated[tuple[str, ...], msgspec.Meta(min_length=2, max_length=3)] = ("127.0.0.3", "127.0.0.4")
    time_scale: float = 0.25

    def __post_init__(self) -> None:
        within("time_scale", self.time_scale, *RANGES["time_scale"])
        loopback_address("address", self.address)
        for i, address in enumerate(self.sensors):
            loopback_address(f"sensors[{i}]", address)
        if len(set(self.sensors)) < len(self.sensors):
            raise InvalidValueError(f"sensors = {', '.join(self.sensors)}: each box needs an address of its own")


BackendEntry = (
    StageEntry | TurningStageEntry | SimulatedUr5eEntry | EmulatedUr5eEntry | EmulatedHandEntry | RigEntry
)
"""Every kind of back end, distinguished by `kind`."""
