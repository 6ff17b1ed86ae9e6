"""What is known of one robot, as one YAML file: back end, fingers, limits.

Read strictly, like sensor files: a key that is misspelt or has another unit, a value that cannot be, is refused
with the reason and the place.
"""

from typing import Annotated

import msgspec

from palpate.errors import InvalidValueError, not_negative
from palpate.open_kinds import declared_in
from palpate.robots.pace_entries import PaceEntry, SimulatedPaceEntry
from palpate.robots.robot_kind import RobotKind
from palpate.robots.sensor_kind import SensorKind
from palpate.robots.simulated_sensor_entry import NoiseEntry, SimulatedSensorEntry
from palpate.robots.surface_entries import SurfaceKind
from palpate.robots.surface_sd_entry import SurfaceSdEntry
from palpate.runtime.robot_ranges import at_most, within
from palpate.runtime.supervision.limits import Limits
from palpate.sensing.ft.sensor_file import PayloadEntry
from palpate.strict_decode import decode_file

FASTEST_FORCE, FASTEST_MOMENT = 1.0, 0.1
"""[N/s, N m/s] Faster is no zero."""


class DriftRateEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Largest drift of a zero after its tare, each axis up or down; `palpate calibrate` measures it at rest.

    Attributes:
        force: [N/s]
        moment: [N m/s]
    """

    force: float = msgspec.field(name="force_N_per_s", default=0.0)
    moment: float = msgspec.field(name="moment_Nm_per_s", default=0.0)

    def __post_init__(self) -> None:
        for key, value, most, unit in (
            ("force_N_per_s", self.force, FASTEST_FORCE, "N/s"),
            ("moment_Nm_per_s", self.moment, FASTEST_MOMENT, "N m/s"),
        ):
            not_negative(key, value, unit)
            at_most(key, value, most, unit)


VERSION = 1
"""Of the file format, under the key `palpate_robot`."""

SHORTEST_PERIOD, LONGEST_PERIOD = 1e-5, 1.0
"""[s] of a control loop: beyond, it is a number in another unit."""

MOST_FINGERS = 16
"""Three hands with a finger to spare; more is a list gone wrong."""


class FingerEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A fingertip and the sensor behind it.

    Attributes:
        surface: The fingertip, in the sensor frame.
        surface_sd: How well it is known; None: exactly in simulation, on a robot its size as a caliper reads it.
        payload: What the sensor carries; None if a sensor file says it.
        sensor: Path of a sensor file, relative to the robot file; None: what is known is what goes without saying
            of the simulated sensor.
        noise: Of a simulated sensor, each axis; None: as `simulated_sensor` has it.
        drift: How fast its zero may wander after a tare; None: too slowly to be told. A grip is held by it.
        simulated_sensor: How a simulated sensor misbehaves otherwise; None: not at all.
        sensor_device: The real sensor, of a rig; None: there is none, or it is simulated.
    """

    surface: SurfaceKind
    surface_sd: SurfaceSdEntry | None = None
    payload: PayloadEntry | None = None
    sensor: str | None = None
    noise: NoiseEntry | None = None
    drift: DriftRateEntry | None = None
    simulated_sensor: SimulatedSensorEntry | None = None
    sensor_device: SensorKind | None = None

    def __post_init__(self) -> None:
        if (self.payload is None) == (self.sensor is None):
            found = "neither" if self.payload is None else "both"
            raise InvalidValueError(
                f"{found} given of payload (what the sensor carries) and sensor (a sensor file, which says it "
                "too): give one"
            )
        if self.sensor is not None and (not self.sensor.strip() or not self.sensor.isprintable()):
            raise InvalidValueError(f"sensor = {self.sensor!r}: must be the path of a sensor file")


class RobotFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One robot. Units stand in the keys of the file.

    Attributes:
        palpate_robot: Version of the format.
        name: One line for people.
        backend: What carries the fingers.
        period: Control period [s].
        pace: Where its time comes from.
        fingers: One or more.
        limits: What must not be exceeded.
    """

    palpate_robot: int = VERSION
    name: str
    backend: RobotKind
    period: float = msgspec.field(name="period_s")
    pace: PaceEntry = SimulatedPaceEntry()
    fingers: Annotated[tuple[FingerEntry, ...], msgspec.Meta(min_length=1, max_length=MOST_FINGERS)]
    limits: Limits = Limits()

    def __post_init__(self) -> None:
        if self.palpate_robot != VERSION:
            raise InvalidValueError(
                f"palpate_robot = {self.palpate_robot!r}: this palpate reads version {VERSION}"
            )
        if not self.name.strip() or not self.name.isprintable() or len(self.name) > 200:
            raise InvalidValueError(
                f"name = {self.name[:40]!r}: must be one line of 1 to 200 printable characters"
            )
        within("period_s", self.period, SHORTEST_PERIOD, LONGEST_PERIOD, "s")
        self.pace.pacer(self.period)
        self._check_sensors()

    def _check_sensors(self) -> None:
        """Refuse real sensors on simulated robots, simulated ones on real robots, and real time that is none."""
        real = self.backend.REAL
        for i, finger in enumerate(self.fingers):
            where = f"fingers[{i}]"
            if not real and finger.sensor_device is not None:
                raise InvalidValueError(
                    f"{where}.sensor_device: is for real devices, backend.kind: rig; leave it out"
                )
            if real and finger.sensor_device is None:
                known = ", ".join(declared_in(SensorKind.GROUP))
                raise InvalidValueError(
                    f"{where}: no sensor_device, which real devices need: {known}, or module:Class"
                )
            if real and finger.simulated_sensor is not None:
                raise InvalidValueError(f"{where}.simulated_sensor: a rig has real ones; leave it out")
            if real and finger.sensor is None and finger.noise is None:
                raise InvalidValueError(
                    f"{where}: neither noise nor sensor (a sensor file, which says it too): a tare tells rest "
                    "from motion by it; `palpate doctor` measures it"
                )
        if real and isinstance(self.pace, SimulatedPaceEntry):
            raise InvalidValueError("pace.kind = simulated: real devices keep real time; write kind: real_time")


def read_robot_file(text: str) -> RobotFile:
    """Return the robot described by the text of a robot file; sensor files it names are not looked at.

    Raises:
        InvalidValueError: It is no robot file, or something in it is wrong; the message names it.
    """
    return decode_file(text, RobotFile, "robot file", "palpate_robot", VERSION)
