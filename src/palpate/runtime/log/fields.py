"""The quantities of one period: names, units and order. All else in this package follows from these tables."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from palpate.errors import InvalidValueError
from palpate.runtime.data import Phase
from palpate.runtime.log.layout import Layout
from palpate.sensing.contact import ContactStatus
from palpate.sensing.ft.health import HealthCheck

PACKAGE = "palpate_msgs"
"""ROS 2 package of palpate's own types; `examples/ros2/palpate_msgs` is its source."""

TRUTH = "truth"
"""Group of the numbers that no sensor tells."""

HAND, FINGER = "hand", f"{PACKAGE}/Finger"
"""Name of the hand's group, type of a finger's."""

LENGTH = "<u4"
"""Of a sequence in CDR."""

_XYZ = ("x", "y", "z")


@dataclass(frozen=True, slots=True)
class LogField:
    """One quantity.

    Attributes:
        name: What it is.
        ros_type: Its type in the schema, without the length of an array.
        dtype: Of one component in the file, little endian.
        components: Name of each component; one empty name for a scalar.
        units: Unit of each component; empty where it has none.
        comment: What a reader of the schema has to know.
        is_array: Whether it is an array of the schema (and not a message or a scalar).
        varies: Whether runs differ in its length: it is a sequence of the schema, an array or optional.
        codes: Names of the values 0, 1, ... of an enumeration; empty for anything else.
    """

    name: str
    ros_type: str
    dtype: str
    components: tuple[str, ...]
    units: tuple[str, ...]
    comment: str
    is_array: bool = False
    varies: bool = False
    codes: tuple[str, ...] = ()

    @property
    def count(self) -> int:
        """Number of components."""
        return len(self.components)

    @property
    def is_vector(self) -> bool:
        """Whether it is more than a number, be it with one component."""
        return self.is_array or self.count > 1


@dataclass(frozen=True, slots=True)
class Constant:
    """What every message of a run holds in one place: the length of a sequence, or what stands for nothing.

    Attributes:
        dtype: In the file, little endian.
        value: A whole number.
    """

    dtype: str
    value: int


@dataclass(frozen=True, slots=True)
class LogGroup:
    """Quantities that belong together: a message inside the message.

    Attributes:
        name: Its name; empty for the quantities of the message itself.
        type_name: Its type in the schema.
        parts: What it consists of, in the order of the message.
    """

    name: str
    type_name: str
    parts: tuple[LogField | Constant, ...]

    @property
    def fields(self) -> tuple[LogField, ...]:
        """Its quantities."""
        return tuple(part for part in self.parts if isinstance(part, LogField))


@dataclass(frozen=True, slots=True)
class Codes:
    """Names behind the small numbers in a log, so that a log outlives a reordered enumeration.

    Attributes:
        phases: Of `Phase`.
        statuses: Of `ContactStatus`.
        measures: Of `HealthCheck`, what is wrong with a sensor.
    """

    phases: tuple[str, ...] = field(default_factory=lambda: tuple(x.name for x in Phase))
    statuses: tuple[str, ...] = field(default_factory=lambda: tuple(x.name for x in ContactStatus))
    measures: tuple[str, ...] = field(default_factory=lambda: tuple(x.name for x in HealthCheck))

    def check_known(self) -> None:
        """Make sure that this palpate knows every name.

        Raises:
            InvalidValueError: It does not.
        """
        for kind, names in ((Phase, self.phases), (ContactStatus, self.statuses), (HealthCheck, self.measures)):
            for name in names:
                if name not in kind.__members__:
                    raise InvalidValueError(
                        f"this palpate does not know its {kind.__name__} {name!r}: read it with a newer one"
                    )


def period_groups(layout: Layout, codes: Codes) -> tuple[LogGroup, ...]:
    """Return all quantities of a period, in the order of rows and messages."""
    groups = [_group("", "", _number("time", "s", "of the period, on the back end's clock")), _arm(layout)]
    if layout.hand_joints is not None:
        groups.append(_hand(layout.hand_joints))
    groups += [_finger(index, channels, codes) for index, channels in enumerate(layout.channels)]
    groups.append(
        _group(
            "",
            "",
            _number("compute_time", "s", "sensing, control and supervision of this period"),
            _number("lateness", "s", "of the wake-up that this period began with"),
        )
    )
    groups.append(_command(layout.grips, layout.finger_velocities, codes))
    if layout.truth:
        numbers = (_number(name, "", "as the simulation knows it") for name in layout.truth)
        groups.append(_group(TRUTH, "float64", *numbers))
    return tuple(groups)


def walk(groups: tuple[LogGroup, ...]) -> Iterator[tuple[LogGroup, LogField]]:
    """Yield every quantity with its group, in order."""
    for group in groups:
        for quantity in group.fields:
            yield group, quantity


def wire(groups: tuple[LogGroup, ...]) -> Iterator[LogField | Constant]:
    """Yield all that a message holds, in order: quantities, and before each sequence its length."""
    names = [group.name for group in groups]
    for group in groups:
        if group.name == HAND:
            yield Constant(LENGTH, 1)
        elif group.name == finger_name(0):
            if HAND not in names:
                yield Constant(LENGTH, 0)
            yield Constant(LENGTH, sum(group.type_name == FINGER for group in groups))
        elif group.name == TRUTH:
            yield Constant(LENGTH, len(group.fields))
        yield from group.parts
    if TRUTH not in names:
        yield Constant(LENGTH, 0)


def finger_name(index: int) -> str:
    """Return the name of a finger's group: finger_0, ..."""
    return f"finger_{index}"


def path_of(group: LogGroup, quantity: LogField) -> str:
    """Return "group.quantity", or "quantity" for one of the message itself."""
    return f"{group.name}.{quantity.name}" if group.name else quantity.name


def _arm(layout: Layout) -> LogGroup:
    force = _vector("tip_force", "N", "of the surroundings on what the flange carries, as the arm measures it")
    return _group(
        "arm",
        f"{PACKAGE}/Arm",
        _number("time", "s", "when it was sampled"),
        _vector("position", "m", "origin of the tip frame in base coordinates"),
        _array("rotation", tuple(f"{i}{j}" for i in range(3) for j in range(3)), "", "tip to base, row by row"),
        _vector("velocity", "m/s", "of the tip frame's origin in base coordinates"),
        _vector("angular_velocity", "rad/s", "of the tip frame in base coordinates"),
        *_joints(layout.joints),
        *_sequence(force, int(layout.tip_force)),
    )


def _hand(joints: int) -> LogGroup:
    return _group(HAND, f"{PACKAGE}/Hand", _number("time", "s", "when it was sampled"), *_joints(joints))


def _joints(count: int) -> tuple[LogField | Constant, ...]:
    return _sequence(_array("joint_position", _indices(count), "", "rad, or m if it slides"), count)


def _sequence(quantity: LogField, length: int) -> tuple[LogField | Constant, ...]:
    """Return a quantity of which there may be more or fewer, or none, with its length before it."""
    varying = (replace(quantity, varies=True),) if length else ()
    return (Constant(LENGTH, length), *varying)


def _finger(index: int, channels: int, codes: Codes) -> LogGroup:
    reading = _array("reading", _indices(channels), "", "as the device gives it: N and N m, or raw channels")
    return _group(
        finger_name(index),
        FINGER,
        _number("time", "s", "when the wrench was sampled"),
        *_sequence(reading, channels),
        _vector("acceleration", "m/s^2", "specific force, sensor frame"),
        _wrench("wrench", "what the object exerts on the finger, sensor frame"),
        _vector("centroid", "m", "of the contact, sensor frame; NaN unless status is OK, and so on down"),
        _vector("normal", "", "outward normal of the fingertip there, sensor frame"),
        _vector("tangential_force", "N", "sensor frame"),
        _number("normal_force", "N", "positive when pushing"),
        _number("spin_torque", "N m", "about the normal"),
        _number("condition", "", "relative error of the centroid per relative error of the wrench"),
        _code("status", codes.statuses, "of the contact"),
        LogField("touching", "bool", "u1", ("",), ("",), "whether there is a contact at all"),
        _code("health", codes.measures, "what is wrong with the sensor"),
    )


def _command(grips: int, finger_velocities: int, codes: Codes) -> LogGroup:
    velocity = _array(
        "finger_velocity",
        tuple(f"{i}{axis}" for i in range(finger_velocities) for axis in "xyz"),
        "m/s",
        "of each fingertip in its sensor frame; NaN: it only presses",
    )
    moving = _count("finger_velocity_count", "how many of them are given; -1: none moves")
    return _group(
        "command",
        f"{PACKAGE}/Command",
        _vector("velocity", "m/s", "of the tip frame's origin in base coordinates"),
        _vector("angular_velocity", "rad/s", "of the tip frame in base coordinates"),
        *_sequence(
            _array("grip_force", _indices(grips), "N", "of each finger of the hand; NaN beyond grip_count"), grips
        ),
        _count("grip_count", "how many grip forces are given; -1: as before"),
        *_sequence(velocity, 3 * finger_velocities),
        moving if finger_velocities else Constant(moving.dtype, -1),
        _code("phase", codes.phases, "what the controller is doing"),
    )


def _group(name: str, type_name: str, *parts: LogField | Constant) -> LogGroup:
    return LogGroup(name, type_name, parts)


def _count(name: str, comment: str) -> LogField:
    return LogField(name, "int8", "i1", ("",), ("",), comment)


def _number(name: str, unit: str, comment: str) -> LogField:
    return LogField(name, "float64", "<f8", ("",), (unit,), comment)


def _vector(name: str, unit: str, comment: str) -> LogField:
    return LogField(name, "geometry_msgs/Vector3", "<f8", _XYZ, (unit,) * 3, comment)


def _wrench(name: str, comment: str) -> LogField:
    components = ("fx", "fy", "fz", "mx", "my", "mz")
    return LogField(name, "geometry_msgs/Wrench", "<f8", components, ("N",) * 3 + ("N m",) * 3, comment)


def _array(name: str, components: tuple[str, ...], unit: str, comment: str) -> LogField:
    return LogField(name, "float64", "<f8", components, (unit,) * len(components), comment, is_array=True)


def _code(name: str, codes: tuple[str, ...], comment: str) -> LogField:
    return LogField(name, "uint8", "u1", ("",), ("",), comment, codes=codes)


def _indices(count: int) -> tuple[str, ...]:
    return tuple(str(i) for i in range(count))
