"""External loads on a held object: ramps, steps or oscillations, at a point off the line of the contacts.

A load is a function of time and of the object's orientation: a force that acts at a point of the object
keeps its direction, and its lever turns with the object, as a weight on a hook does. It remembers nothing, so that
a snapshot needs nothing of it.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import mujoco

from palpate.errors import InvalidValueError, check_not_negative, not_negative, positive, vector
from palpate.spatial import ZERO, Matrix, Vector, Wrench, add_scaled, cross, rotate, scale, subtract

NO_LOAD: Wrench = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class ObjectLoad(Protocol):
    """What acts on the object besides gravity and the fingers."""

    def wrench(self, time: float, rotation_base_object: Matrix) -> Wrench:
        """Return what acts at a time, about the origin of the object's frame, in base coordinates [N, N m].

        Args:
            time: On the back end's clock [s].
            rotation_base_object: How the object is turned.
        """
        ...


@dataclass(frozen=True, slots=True)
class RampLoad:
    """A force at a point of the object that goes steadily from one value to another.

    A weight that grows; within a few hundredths of a second, a load step.

    Attributes:
        before: Force until the ramp begins, base frame [N].
        after: Force when it is over [N].
        begin: When the ramp begins [s].
        duration: How long it takes [s]; 0 is a jump.
        point: Where the force acts, in the object's frame [m].
    """

    before: Vector
    after: Vector
    begin: float
    duration: float
    point: Vector = ZERO

    def __post_init__(self) -> None:
        for name in ("before", "after", "point"):
            vector(name, getattr(self, name), 3, "m" if name == "point" else "N")
        check_not_negative(self, begin="s", duration="s")

    def force(self, time: float) -> Vector:
        """Return the force at a time [N]."""
        gone = time - self.begin
        if gone < 0.0:
            return self.before
        if gone >= self.duration:
            return self.after
        share = gone / self.duration
        return add_scaled(self.before, share, subtract(self.after, self.before))

    def wrench(self, time: float, rotation_base_object: Matrix) -> Wrench:
        """See `ObjectLoad`."""
        return _at(self.force(time), self.point, rotation_base_object)


@dataclass(frozen=True, slots=True)
class ShakenLoad:
    """A force that swings about zero at a point of the object: f(t) = amplitude sin(2 pi frequency (t - begin)).

    Attributes:
        amplitude: Largest force, base frame [N].
        frequency: [Hz].
        begin: When it begins [s]; nothing before.
        end: When it ends [s].
        point: Where the force acts, in the object's frame [m].
    """

    amplitude: Vector
    frequency: float
    begin: float = 0.0
    end: float = math.inf
    point: Vector = ZERO

    def __post_init__(self) -> None:
        vector("amplitude", self.amplitude, 3, "N")
        vector("point", self.point, 3, "m")
        positive("frequency", self.frequency, "Hz")
        not_negative("begin", self.begin, "s")
        if not self.end > self.begin:
            raise InvalidValueError(f"end = {self.end!r} s: must be later than begin = {self.begin:g} s")

    def force(self, time: float) -> Vector:
        """Return the force at a time [N]."""
        if not self.begin <= time < self.end:
            return ZERO
        return scale(math.sin(2.0 * math.pi * self.frequency * (time - self.begin)), self.amplitude)

    def wrench(self, time: float, rotation_base_object: Matrix) -> Wrench:
        """See `ObjectLoad`."""
        return _at(self.force(time), self.point, rotation_base_object)


@dataclass(frozen=True, slots=True)
class SumOfLoads:
    """Several loads at once.

    Attributes:
        loads: Which.
    """

    loads: tuple[ObjectLoad, ...]

    def wrench(self, time: float, rotation_base_object: Matrix) -> Wrench:
        """See `ObjectLoad`."""
        a, b, c, d, e, f = NO_LOAD
        for load in self.loads:
            u, v, w, p, q, r = load.wrench(time, rotation_base_object)
            a, b, c, d, e, f = a + u, b + v, c + w, d + p, e + q, f + r
        return (a, b, c, d, e, f)


class LoadDrive:
    """Puts a load on the object's body in a compiled scene. `advance` comes before each time step.

    It writes `xfrc_applied`, which MuJoCo counts among the external forces, so that the fingers' sensors feel it
    in the same time step, and which a friction plant leaves standing.
    """

    def __init__(self, load: ObjectLoad, model: mujoco.MjModel, data: mujoco.MjData, body: str) -> None:
        """Take a load and the body that bears it.

        Args:
            load: What pulls.
            model: The compiled scene.
            data: Its state, which must live on.
            body: Name of a body that floats freely.

        Raises:
            InvalidValueError: The body does not float freely.
        """
        self._load, self._data = load, data
        of = model.body(body)
        joints = model.jnt_type[int(of.jntadr[0]) :][: int(of.jntnum[0])].tolist()
        if joints != [int(mujoco.mjtJoint.mjJNT_FREE)]:
            raise InvalidValueError(f"body = {body!r}: must float freely, on one free joint")
        at = int(model.jnt_qposadr[int(of.jntadr[0])])
        # views that live as long as the data; the body's pose itself is that of the time step before
        self._quat_wxyz = data.qpos[at + 3 : at + 7]
        self._applied = data.xfrc_applied[int(of.id)]
        x, y, z = of.ipos.tolist()
        self._center_of_mass: Vector = (x, y, z)
        self.start()

    def start(self) -> None:
        """Nothing has been applied yet."""
        self.last = NO_LOAD
        """What was applied in the last time step, as `ObjectLoad.wrench` tells it [N, N m]."""

    def advance(self) -> None:
        """Apply what the load is now."""
        rotation = _rotation_of(*self._quat_wxyz.tolist())
        self.last = (a, b, c, d, e, f) = self._load.wrench(self._data.time, rotation)
        # xfrc_applied is about the body's centre of mass
        u, v, w = cross(rotate(rotation, self._center_of_mass), (a, b, c))
        self._applied[:] = (a, b, c, d - u, e - v, f - w)


def _at(force: Vector, point: Vector, rotation_base_object: Matrix) -> Wrench:
    return (*force, *cross(rotate(rotation_base_object, point), force))


def _rotation_of(w: float, x: float, y: float, z: float) -> Matrix:
    """The rotation of a quaternion, of whatever length: MuJoCo's are normalised only when they are used."""
    s = 2.0 / (w * w + x * x + y * y + z * z)
    return (
        (1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)),
        (s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x)),
        (s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y)),
    )
