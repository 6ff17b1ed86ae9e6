"""A recorded stroke: readings of sensor and arm while a fingertip rubbed or turned on a surface.

Everything that is measured from strokes rests on two quantities that do not depend on where the sensor's origin
is, nor on the fingertip's shape (f and m are the wrench about any one point):

    angle between two forces of full slip there and back = 2 atan(mu),        the normal bisects it;
    spin torque = m.f / f.n,   for m = c x f + q n gives m.f = q n.f whatever the contact centroid c is.

The second is the pitch of the wrench axis (Ball 1900), of first order free of the normal's error too.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError, numbers

MIN_SAMPLES = 40
"""Below, there are not eight batches of five samples to tell noise from."""


@dataclass(frozen=True, slots=True, eq=False)
class RubbingStroke:
    """One motion in one direction, from before it starts until it ends, in contact all the time; n samples.

    Attributes:
        time: Of each sample, rising, shape (n,) [s].
        wrench: What the object exerts on the finger: weight, inertia and tare taken off; sensor frame, about its
            origin, shape (n, 6) [N, N m].
        rotation_base_tip: Maps the sensor frame to base coordinates, shape (n, 3, 3).
        position: Of the sensor frame's origin, base coordinates, shape (n, 3) [m].
        velocity: Of the same, shape (n, 3) [m/s].
        angular_velocity: Of the finger, base coordinates, shape (n, 3) [rad/s].
        centroid: Of the contact as it was taken for, sensor frame, shape (n, 3) [m]. Only its
            speed goes by it.
    """

    time: FloatArray
    wrench: FloatArray
    rotation_base_tip: FloatArray
    position: FloatArray
    velocity: FloatArray
    angular_velocity: FloatArray
    centroid: FloatArray

    def __post_init__(self) -> None:
        n = len(self.time)
        if n < MIN_SAMPLES:
            raise InvalidValueError(f"a stroke of {n} samples: must have at least {MIN_SAMPLES}; rub for longer")
        widths: dict[str, tuple[int, ...]] = {
            "time": (),
            "wrench": (6,),
            "rotation_base_tip": (3, 3),
            "position": (3,),
            "velocity": (3,),
            "angular_velocity": (3,),
            "centroid": (3,),
        }
        for name, width in widths.items():
            array = numbers(name, getattr(self, name))
            if array.shape != (n, *width):
                raise InvalidValueError(f"{name} has shape {array.shape}: must be {(n, *width)}, as many as times")
            if not np.isfinite(array).all():
                raise InvalidValueError(f"{name}: every entry must be finite; leave out samples without contact")
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if not (np.diff(self.time) > 0.0).all():
            raise InvalidValueError("time of a stroke: must rise from sample to sample; leave out repeated ones")

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.time)

    @property
    def force(self) -> FloatArray:
        """What the object exerts on the finger, base coordinates, shape (n, 3) [N]."""
        return _turned(self.rotation_base_tip, self.wrench[:, :3])

    def spin_torque(self, normal: FloatArray) -> FloatArray:
        """Return the torque about a normal, whatever the contact centroid, shape (n,) [N m].

        Args:
            normal: Out of the finger into the object, base coordinates, shape (3,).
        """
        pitch = np.einsum("ij,ij->i", self.wrench[:, :3], self.wrench[:, 3:])
        return np.asarray(pitch / (self.force @ normal))

    @property
    def contact(self) -> FloatArray:
        """Where the contact is, base coordinates, shape (n, 3) [m]."""
        return np.asarray(self.position + _turned(self.rotation_base_tip, self.centroid))

    @property
    def contact_velocity(self) -> FloatArray:
        """Of the finger's material at the contact, base coordinates, shape (n, 3) [m/s]."""
        arm = _turned(self.rotation_base_tip, self.centroid)
        return self.velocity + np.cross(self.angular_velocity, arm)


@dataclass(frozen=True, slots=True, eq=False)
class TwoWay:
    """A motion and the same one back, over the same place at the same load.

    Attributes:
        there: The first of the two.
        back: The second, in the opposite direction.
    """

    there: RubbingStroke
    back: RubbingStroke

    @property
    def both(self) -> tuple[RubbingStroke, RubbingStroke]:
        """Both of them."""
        return self.there, self.back


def steady_part(time: FloatArray, speed: FloatArray, settling: float) -> slice:
    """Return where a motion is steady: reversal, transient and what a filter still remembers of them left out.

    From `settling` after the motion has begun until before it slows down. Speeds are smoothed, so that a motion
    that sticks and slips is steady too.

    Args:
        time: Shape (n,) [s].
        speed: In the direction of the motion, shape (n,) [m/s or rad/s].
        settling: How long the motion's and the sensor's transients last [s].

    Raises:
        InvalidValueError: Nothing is left.
    """
    step = float(np.median(np.diff(time)))
    width = max(1, min(round(SMOOTHING / step), len(time) // 4))
    smooth = np.convolve(
        np.pad(speed, (width // 2, width - 1 - width // 2), "edge"), np.full(width, 1 / width), "valid"
    )
    usual = float(np.quantile(smooth, 0.6))
    if usual <= 0.0:
        raise InvalidValueError("the finger does not move in this stroke: must be a motion in one direction")
    fast = np.flatnonzero(smooth > 0.75 * usual)
    first = int(np.searchsorted(time, time[fast[0]] + settling))
    last = int(np.searchsorted(time, time[fast[-1]] - 0.5 * SMOOTHING, side="right"))
    if last - first < MIN_SAMPLES:
        raise InvalidValueError(
            f"of a stroke of {time[-1] - time[0]:.3g} s, {max(0, last - first)} samples are steady after "
            f"a settling time of {settling:g} s: must be at least {MIN_SAMPLES}; rub for longer"
        )
    return slice(first, last)


SMOOTHING = 0.02
"""Over how long speeds are averaged to see when a motion begins and ends [s]: a few periods of stick-slip."""


def batch_means(values: FloatArray, batches: int = 8) -> FloatArray:
    """Return means of equally long stretches, shape (batches, ...): their spread tells the mean's own noise.

    However the samples hang together (filters, a device slower than its reader), as long as a stretch is longer
    than that (Law & Kelton, Simulation Modeling and Analysis, section 9.5.3).
    """
    length = len(values) // batches
    return np.asarray(values[: batches * length].reshape(batches, length, *values.shape[1:]).mean(axis=1))


def _turned(rotation: FloatArray, vectors: FloatArray) -> npt.NDArray[np.float64]:
    return np.asarray(np.einsum("nij,nj->ni", rotation, vectors))
