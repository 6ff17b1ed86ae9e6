"""The wrench that the environment puts on a held object, from what its fingers feel.

Each finger feels (f_i, m_i), what the object exerts on it; at position p_i and rotation R_i in the object's frame.
Newton and Euler for the object, about the origin of its frame:

    f = sum R_i f_i + M s
    m = sum (R_i m_i + p_i x R_i f_i) + c x M s + I a + w x I w

with mass M, centre of mass c, inertia I about it, angular velocity w and acceleration a, and the specific force s
at the centre of mass: what an accelerometer there shows, acceleration less gravity. So (f, m) is what the
environment exerts on the object, as a finger's wrench is what the object exerts on the finger: a held tool is a
fingertip.

Two kinds of error add up. Noise of the sensors is another at each sample. Zeros of the sensors, poses of the
fingers, mass and centre of mass are wrong by the same at every sample: `ExternalWrenches.common` says what that
does, so that a mean of many samples is not taken for better than it is, nor a change for worse.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError, check_not_negative, numbers
from palpate.estimation.covariance import covariance_matrix
from palpate.kinematics.pose import Pose
from palpate.sensing.contact_jacobian import cross_matrices
from palpate.sensing.held.wrench_frame import into_matrix, wrench_from
from palpate.spatial import ZERO, Matrix, Vector, Wrench, add, cross, rotate, scale

POSE = "[position, rotation vector]: of standard deviations, np.diag([d**2] * 3 + [r**2] * 3)"
WRENCH = "np.cov of wrenches at rest is one"


@dataclass(frozen=True, slots=True)
class HeldBody:
    """What a hand holds, in its own frame.

    Attributes:
        mass: [kg]
        center_of_mass: [m]
        inertia: About the centre of mass, along the frame's axes [kg m^2].
        mass_sd: Standard deviation of the mass [kg].
        center_of_mass_sd: Of the centre of mass, each axis [m].

    Raises:
        InvalidValueError: A mass or standard deviation is negative or not finite.
    """

    mass: float = 0.0
    center_of_mass: Vector = ZERO
    inertia: Matrix = (ZERO, ZERO, ZERO)
    mass_sd: float = 0.0
    center_of_mass_sd: float = 0.0

    def __post_init__(self) -> None:
        check_not_negative(self, mass="kg", mass_sd="kg", center_of_mass_sd="m")


@dataclass(frozen=True, slots=True, eq=False)
class FingersFelt:
    """What k fingers felt of one object in n samples. Whatever is the same for all samples needs no leading n.

    Attributes:
        wrench: What the object exerts on each finger, in and about its sensor frame, shape (n, k, 6) [N, N m].
        rotation: Of each sensor in the object's frame, shape (k, 3, 3) or (n, k, 3, 3).
        position: Likewise, shape (k, 3) or (n, k, 3) [m].
        noise: Covariance of each reading, independent from sample to sample, shape (k, 6, 6) or (n, k, 6, 6).
        zero: Covariance of each sensor's zero, the same error in all samples, shape (k, 6, 6).
        pose: Covariance of each sensor's position (3) and rotation vector (3), along the object's axes, the
            rotation about the sensor's origin, the same error in all samples, shape (k, 6, 6).
        matrix: Standard deviation of each entry of the sensor's matrix, by which every axis of the wrench adds to
            every other, independent, the same error in all samples, shape (6, 6) or (k, 6, 6). A firm grip's
            forces are large against what the environment exerts, and this error goes with them.

    Raises:
        InvalidValueError: Shapes do not fit, or something is no covariance.
    """

    wrench: FloatArray
    rotation: FloatArray
    position: FloatArray
    noise: FloatArray
    zero: FloatArray
    pose: FloatArray
    matrix: FloatArray = field(default_factory=lambda: np.zeros((6, 6)))

    def __post_init__(self) -> None:
        wrench = numbers("wrench", self.wrench)
        if wrench.ndim != 3 or wrench.shape[2] != 6 or not wrench.shape[1]:
            raise InvalidValueError(
                f"wrench has shape {wrench.shape}: must be (n, k, 6), samples, fingers, then force and moment"
            )
        object.__setattr__(self, "wrench", wrench)
        n, k, _ = wrench.shape
        for name, inner in (("rotation", (3, 3)), ("position", (3,))):
            object.__setattr__(self, name, _per_finger(name, numbers(name, getattr(self, name)), (n, k), inner))
        for name, remedy in (("noise", WRENCH), ("zero", WRENCH), ("pose", POSE)):
            checked = covariance_matrix(name, getattr(self, name), 6, remedy=remedy)
            object.__setattr__(self, name, _per_finger(name, checked, (n, k), (6, 6)))
        matrix = numbers("matrix", self.matrix)
        object.__setattr__(self, "matrix", np.array([matrix] * k) if matrix.shape == (6, 6) else matrix)
        for name in ("zero", "pose", "matrix"):
            if getattr(self, name).shape != (k, 6, 6):
                raise InvalidValueError(f"{name} has shape {getattr(self, name).shape}: must be ({k}, 6, 6)")


@dataclass(frozen=True, slots=True, eq=False)
class ObjectMotion:
    """How the object moved, in its own frame; whatever is the same for all samples needs no leading n.

    Attributes:
        specific_force: Acceleration of the frame's origin less gravity, shape (3,) or (n, 3) [m/s^2].
        angular_velocity: Likewise [rad/s].
        angular_acceleration: Likewise [rad/s^2].
    """

    specific_force: FloatArray
    angular_velocity: FloatArray
    angular_acceleration: FloatArray

    @classmethod
    def at_rest(cls, specific_force: Vector | FloatArray) -> "ObjectMotion":
        """Return that of an object that does not turn: minus gravity in its frame, where it stands still."""
        return cls(np.asarray(specific_force, np.float64), np.zeros(3), np.zeros(3))


@dataclass(frozen=True, slots=True, eq=False)
class ExternalWrenches:
    """What the environment exerts on the object in n samples, in the object's frame.

    Attributes:
        wrench: Shape (n, 6) [N, N m], about the frame's origin.
        noise: Covariance of what is independent from sample to sample, shape (n, 6, 6).
        common: What errors do that are the same in all samples: of q independent ones of variance 1, shape
            (n, 6, q). The covariance between samples i and j is common[i] @ common[j].T.
    """

    wrench: FloatArray
    noise: FloatArray
    common: FloatArray

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.wrench)

    @property
    def covariance(self) -> FloatArray:
        """Of each sample by itself, shape (n, 6, 6)."""
        return np.asarray(self.noise + self.common @ self.common.transpose(0, 2, 1))

    def part(self, rows: slice) -> "ExternalWrenches":
        """Return some consecutive ones."""
        return ExternalWrenches(self.wrench[rows], self.noise[rows], self.common[rows])

    def mean(self) -> "ExternalWrenches":
        """Return their mean, as one sample."""
        return ExternalWrenches(
            self.wrench.mean(axis=0, keepdims=True),
            self.noise.sum(axis=0, keepdims=True) / len(self) ** 2,
            self.common.mean(axis=0, keepdims=True),
        )

    def less(self, air: "ExternalWrenches") -> "ExternalWrenches":
        """Return them less the mean of those without contact, taken with the same fingers just before.

        What is wrong by the same in both cancels: zeros, and of weight and poses what a grip that is held leaves.

        Args:
            air: When nothing but the fingers touched the object.

        Raises:
            InvalidValueError: Their errors are not the same ones.
        """
        if air.common.shape[2] != self.common.shape[2]:
            raise InvalidValueError(
                f"air has {air.common.shape[2]} common errors, not {self.common.shape[2]}: must be of the same "
                "fingers"
            )
        before = air.mean()
        unsure = np.broadcast_to(_root(before.noise), (len(self), 6, 6))
        return ExternalWrenches(
            self.wrench - before.wrench,
            self.noise,
            np.concatenate((self.common - before.common, unsure), axis=2),
        )

    @classmethod
    def measured(
        cls, wrenches: npt.ArrayLike, noise: npt.ArrayLike, zero: npt.ArrayLike | None = None
    ) -> "ExternalWrenches":
        """Return those of one sensor that itself carries the tool, weight and inertia taken off.

        Args:
            wrenches: In and about the sensor frame, shape (n, 6).
            noise: Covariance of a reading, shape (6, 6).
            zero: Covariance of the sensor's zero, the same error in all samples, shape (6, 6); None: none.

        Raises:
            InvalidValueError: Shapes do not fit, or something is no covariance.
        """
        rows = numbers("wrenches", wrenches)
        if rows.ndim != 2 or rows.shape[1] != 6:
            raise InvalidValueError(
                f"wrenches has shape {rows.shape}: must be (n, 6), force then moment in each row"
            )
        E, Z = (
            covariance_matrix(name, np.zeros((6, 6)) if each is None else each, 6, remedy=WRENCH)
            for name, each in (("noise", noise), ("zero", zero))
        )
        n = len(rows)
        return cls(rows, np.broadcast_to(E, (n, 6, 6)), np.broadcast_to(_root(Z), (n, 6, 6)))

    def seen_from(self, pose: Pose, pose_covariance: FloatArray | None = None) -> "ExternalWrenches":
        """Return them in and about frame b, with pose_a_b where a is their frame.

        Args:
            pose: pose_a_b.
            pose_covariance: Of its position (3) and rotation vector (3) along the axes of a, the rotation about
                the origin of b, shape (6, 6); None: it is exact. It is the same error in all samples.
        """
        X = into_matrix(pose)
        wrench, common = self.wrench @ X.T, X @ self.common
        if pose_covariance is not None:
            back = np.array(pose.rotation).T
            f, m = _crosses(wrench[:, :3]) @ back, _crosses(wrench[:, 3:]) @ back
            by_pose = np.concatenate(
                (np.concatenate((np.zeros_like(f), f), axis=2), np.concatenate((f, m), axis=2)), axis=1
            )
            common = np.concatenate((common, by_pose @ _root(pose_covariance)), axis=2)
        return ExternalWrenches(wrench, X @ self.noise @ X.T, common)


def external_wrenches(felt: FingersFelt, held: HeldBody, motion: ObjectMotion) -> ExternalWrenches:
    """Return what the environment exerts on a held object, with covariances.

    Args:
        felt: By each finger that touches the object; one that is left out counts as environment.
        held: The object.
        motion: How it moved.
    """
    n, k, _ = felt.wrench.shape
    R, p = (
        np.broadcast_to(each, (n, k, *each.shape[-r:])) for each, r in ((felt.rotation, 2), (felt.position, 1))
    )
    X = np.zeros((n, k, 6, 6))
    X[..., :3, :3] = X[..., 3:, 3:] = R
    X[..., 3:, :3] = _crosses(p) @ R
    about = np.einsum("nkab,nkb->nka", X, felt.wrench)  # in the object's frame, about its origin
    force, turning = about[..., :3], np.einsum("nkab,nkb->nka", R, felt.wrench[..., 3:])
    by_pose = np.zeros((n, k, 6, 6))
    by_pose[..., :3, 3:] = by_pose[..., 3:, :3] = -_crosses(force)
    by_pose[..., 3:, 3:] = -_crosses(turning) - _crosses(p) @ _crosses(force)

    c, inertia = np.asarray(held.center_of_mass), np.asarray(held.inertia)
    s, w, a = (
        np.broadcast_to(np.asarray(each, np.float64), (n, 3))
        for each in (motion.specific_force, motion.angular_velocity, motion.angular_acceleration)
    )
    swung = _crosses(a) + _crosses(w) @ _crosses(w)  # times c: the acceleration of the centre of mass by turning
    at_center = s + swung @ c
    weight = held.mass * at_center
    momentum = w @ inertia.T
    own = np.concatenate((weight, np.cross(c, weight) + a @ inertia.T + np.cross(w, momentum)), axis=1)
    by_mass = np.concatenate((at_center, np.cross(c, at_center)), axis=1)[:, :, None]
    by_center = held.mass * np.concatenate((swung, _crosses(c) @ swung - _crosses(at_center)), axis=1)

    by_matrix = np.einsum("nkia,kab,nkb->nkiab", X, felt.matrix, felt.wrench).reshape(n, k, 6, 36)

    def flat(each: FloatArray) -> FloatArray:
        return each.transpose(0, 2, 1, 3).reshape(n, 6, -1)

    return ExternalWrenches(
        wrench=about.sum(axis=1) + own,
        noise=(X @ felt.noise @ X.swapaxes(-1, -2)).sum(axis=1),
        common=np.concatenate(
            (
                flat(by_pose @ _root(felt.pose)),
                flat(X @ _root(felt.zero)),
                flat(by_matrix),
                held.mass_sd * by_mass,
                held.center_of_mass_sd * by_center,
            ),
            axis=2,
        ),
    )


def external_wrench(
    wrenches: Sequence[Wrench],
    poses: Sequence[Pose],
    held: HeldBody,
    specific_force: Vector,
    angular_velocity: Vector = ZERO,
    angular_acceleration: Vector = ZERO,
) -> Wrench:
    """Return what the environment exerts on a held object now: `external_wrenches` for a control loop.

    Args:
        wrenches: What the object exerts on each finger, in and about its sensor frame.
        poses: Of each sensor in the object's frame.
        held: The object.
        specific_force: Acceleration of its frame's origin less gravity, in it [m/s^2].
        angular_velocity: In its frame [rad/s].
        angular_acceleration: Likewise [rad/s^2].

    Raises:
        ValueError: Not as many poses as wrenches.
    """
    c, w, a = held.center_of_mass, angular_velocity, angular_acceleration
    f = scale(held.mass, add(specific_force, add(cross(a, c), cross(w, cross(w, c)))))
    momentum = rotate(held.inertia, w)
    m = add(cross(c, f), add(rotate(held.inertia, a), cross(w, momentum)))
    for wrench, pose in zip(wrenches, poses, strict=True):
        x, y, z, *rest = wrench_from(pose, wrench)
        f, m = add(f, (x, y, z)), add(m, (rest[0], rest[1], rest[2]))
    return (*f, *m)


def _per_finger(name: str, array: FloatArray, samples: tuple[int, int], inner: tuple[int, ...]) -> FloatArray:
    n, k = samples
    if array.shape not in {(k, *inner), (n, k, *inner)}:
        raise InvalidValueError(f"{name} has shape {array.shape}: must be {(k, *inner)} or {(n, k, *inner)}")
    if not np.isfinite(array).all():
        raise InvalidValueError(f"{name}: every entry must be finite")
    return array


def _crosses(a: FloatArray) -> FloatArray:
    """Return [a] with [a] b = a x b for each, shape (..., 3, 3)."""
    return cross_matrices(a.reshape(-1, 3)).reshape(*a.shape, 3)


def _root(covariance: FloatArray) -> FloatArray:
    """Return G with G G' = covariance, also where it is singular."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0))[..., None, :])
