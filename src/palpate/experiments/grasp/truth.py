"""What really happened in a grasp, kept beside what was sensed, one row per period."""

import math
from array import array
from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from palpate.controllers.grip.grasp import GraspController, GraspStage
from palpate.errors import FloatArray
from palpate.experiments.grasp.clearance import clearance
from palpate.experiments.grasp.config import GraspConfig
from palpate.robots.hand_description import HandDescription
from palpate.runtime import Command, Observation, Sample
from palpate.runtime.truth import TruthSource
from palpate.sim.hand.hand_model import HandModel
from palpate.sim.hand.truth_numbers import GraspMoments, moments_of_numbers

STAGES = tuple(GraspStage)

OWN = 4
"""Columns before the commanded grips and the numbers of the truth: time, stage, target, regrips."""


@dataclass(frozen=True, slots=True, eq=False)
class GraspTruth:
    """What really happened, one row per period (n) and finger (k).

    Slip and spin are of the object over each fingertip since `watched`: how far the point that was under the
    finger then has moved over it across the normal, and how far the object has turned about the normal, what is
    elastic included. Where the friction plant rubs, whose bristles bend, it is the integral of the contacts' slip
    and spin speeds.

    Attributes:
        time: Shape (n,) [s].
        stage: Index in `STAGES`, shape (n,).
        touching: Shape (n, k).
        contact: From the object's origin, base frame, shape (n, k, 3) [m].
        normal: Into the object, base frame, shape (n, k, 3).
        loads: Normal force [N], length of the tangential force [N], spin torque [N m], shape (n, k, 3).
        slip: Shape (n, k) [m].
        spin: Shape (n, k) [rad].
        command: Grip that was commanded, shape (n, k) [N]; NaN where nothing was.
        target: Grip that was wanted, without correction, shape (n,) [N].
        pull: On the object besides fingers and weight, about its origin, shape (n, 6) [N, N m].
        height: Of the object's origin, shape (n,) [m].
        clearance: From the table to the lowest point of the object, shape (n,) [m]; 0 or less: it touches.
        slid: As slip, but since the lift began, shape (n, k) [m].
        turned: As spin, but since the lift began, shape (n, k) [rad].
        regrips: How often the grip had been raised for an alarm by then, shape (n,).
        quat_wxyz: The object's orientation, object to base, shape (n, 4).
        tip: Middle of each fingertip, as `contact`, shape (n, k, 3) [m].
        force: What the object exerts on each, base frame, shape (n, k, 3) [N].
    """

    time: FloatArray
    stage: npt.NDArray[np.intp]
    touching: npt.NDArray[np.bool_]
    contact: FloatArray
    normal: FloatArray
    loads: FloatArray
    slip: FloatArray
    spin: FloatArray
    command: FloatArray
    target: FloatArray
    pull: FloatArray
    height: FloatArray
    clearance: FloatArray
    slid: FloatArray
    turned: FloatArray
    regrips: npt.NDArray[np.intp]
    quat_wxyz: FloatArray
    tip: FloatArray
    force: FloatArray

    def __len__(self) -> int:
        """Number of periods."""
        return len(self.time)

    @property
    def phase(self) -> npt.NDArray[np.str_]:
        """Name of the stage, shape (n,)."""
        return np.array(STAGES, dtype=np.str_)[self.stage]

    @property
    def fingers(self) -> int:
        """How many there are."""
        return int(self.touching.shape[1])


class GraspTruthRecorder:
    """An observer that asks for the truth at every sample: of a back end, or of a log."""

    def __init__(
        self,
        source: TruthSource,
        controller: GraspController,
        config: GraspConfig,
        hand: HandDescription,
        watched: float,
        *,
        rubbed: bool,
    ) -> None:
        """Take the source of the truth.

        Args:
            source: Of the numbers of a hand (`palpate.sim.hand.truth_numbers`).
            controller: Whose stage and target are kept.
            config: What is held.
            hand: That holds it.
            watched: From when on slip and spin are counted [s]: by then the object must be held.
            rubbed: Whether the friction plant rubs: then slip and spin are those that it reports.
        """
        self._source, self._controller, self._config, self._from = source, controller, config, watched
        self._hand, self._period, self._rubbed = hand.geometry, hand.period, rubbed
        self._no_grip = (math.nan,) * hand.geometry.fingers
        self._width = OWN + hand.geometry.fingers + len(source.truth_columns)
        self._rows = array("d")

    def __call__(self, sample: Sample, now: Observation, command: Command) -> None:
        """Append the truth that belongs to this sample."""
        controller, rows = self._controller, self._rows
        grip = controller.grip
        wanted = grip.target
        if controller.stage is GraspStage.LET_GO and command.grip_force is not None:
            wanted = max(command.grip_force)
        rows.extend((now.time, STAGES.index(controller.stage), wanted, grip.regrips))
        rows.extend(command.grip_force or self._no_grip)
        rows.extend(self._source.truth_row())

    def truth(self) -> GraspTruth:
        """Return all that was appended so far."""
        hand = self._hand
        k = hand.fingers
        rows = np.array(self._rows).reshape(-1, self._width)
        time, stage = rows[:, 0], rows[:, 1].astype(np.intp)
        moments = moments_of_numbers(rows[:, OWN + k :], k)
        fingers = _Fingers.of(hand, moments)
        pressed = -np.sum(moments.force * fingers.normal, axis=2)
        aside = np.linalg.norm(moments.force + pressed[:, :, None] * fingers.normal, axis=2)
        spun = np.sum(moments.torque * fingers.normal, axis=2)
        pulled, lifted = (
            self._slipped(moments, fingers, begun)
            for begun in (time >= self._from, stage == STAGES.index(GraspStage.LIFT))
        )
        position = moments.position[:, None, :]
        return GraspTruth(
            time=time,
            stage=stage,
            touching=moments.touching,
            contact=moments.contact - position,
            normal=fingers.normal,
            loads=np.stack([pressed, aside, spun], axis=2),
            slip=pulled[:, :, 0],
            spin=pulled[:, :, 1],
            command=rows[:, OWN : OWN + k],
            target=rows[:, 2],
            pull=moments.pull,
            height=moments.position[:, 2],
            clearance=clearance(self._config, moments.position[:, 2], moments.quat_wxyz),
            slid=lifted[:, :, 0],
            turned=lifted[:, :, 1],
            regrips=rows[:, 3].astype(np.intp),
            quat_wxyz=moments.quat_wxyz,
            tip=fingers.tip - position,
            force=moments.force,
        )

    def _slipped(self, moments: GraspMoments, fingers: "_Fingers", begun: npt.NDArray[np.bool_]) -> FloatArray:
        """Slip [m] and spin [rad] over each finger from the first period on in which it has begun, (n, k, 2)."""
        slipped = np.zeros_like(moments.slip)
        if begun.any():
            first = int(begun.argmax())
            since = slipped[first:]
            since[:] = (
                np.cumsum(moments.slip[first:] * self._period, axis=0) if self._rubbed else fingers.moved(first)
            )
        return slipped


@dataclass(frozen=True, slots=True, eq=False)
class _Fingers:
    """Where fingertips are, and the object in their sensors' frames.

    Attributes:
        tip: Middle of each fingertip, base frame, shape (n, k, 3) [m].
        normal: Out of it where it is touched, along its closing where it is not; base frame, shape (n, k, 3).
        inwards: The same in its sensor's frame.
        contact: Where it is touched, sensor frame, shape (n, k, 3) [m].
        position: Of the object, sensor frame, shape (n, k, 3) [m].
        rotation: Object to sensor, shape (n, k, 3, 3).
    """

    tip: FloatArray
    normal: FloatArray
    inwards: FloatArray
    contact: FloatArray
    position: FloatArray
    rotation: FloatArray

    @classmethod
    def of(cls, hand: HandModel, moments: GraspMoments) -> Self:
        """Return them."""
        poses = [hand.sensor_poses(tuple(joints)) for joints in moments.joint_position.tolist()]
        rotations = np.array([[its.rotation for its in each] for each in poses]).reshape(-1, hand.fingers, 3, 3)
        places = np.array([[its.position for its in each] for each in poses]).reshape(-1, hand.fingers, 3)
        turn = moments.hand_rotation[:, None] @ rotations
        origin = moments.hand_position[:, None] + np.einsum("nij,nkj->nki", moments.hand_rotation, places)
        tip = origin + np.einsum("nkij,kj->nki", turn, np.array([its.center_of_mass for its in hand.tips]))
        out = moments.contact - tip
        size = np.linalg.norm(out, axis=2, keepdims=True)
        touching = moments.touching[:, :, None]
        normal = np.where(touching, out / np.where(touching, size, 1.0), turn[:, :, :, 0])
        back = np.swapaxes(turn, 2, 3)
        w, x, y, z = moments.quat_wxyz.T
        rotation = Rotation.from_quat(np.stack([x, y, z, w], axis=1)).as_matrix()

        def seen(vectors: FloatArray) -> FloatArray:
            turned: FloatArray = np.einsum("nkij,nkj->nki", back, vectors)
            return turned

        return cls(
            tip,
            normal,
            seen(normal),
            seen(moments.contact - origin),
            seen(moments.position[:, None] - origin),
            back @ rotation[:, None],
        )

    def moved(self, first: int) -> FloatArray:
        """How far the object has slipped [m] and spun [rad] over each finger since a period, shape (n, k, 2)."""
        inwards, under = self.inwards[first], self.contact[first]
        began = np.swapaxes(self.rotation[first], 1, 2)
        point = np.einsum("kij,kj->ki", began, under - self.position[first])
        over = np.einsum("nkij,kj->nki", self.rotation[first:], point) + self.position[first:] - under
        aside = over - np.sum(over * inwards, axis=2, keepdims=True) * inwards
        # of the turn's quaternion, the share about the normal (swing and twist)
        turns = self.rotation[first:] @ began
        quaternion = Rotation.from_matrix(turns.reshape(-1, 3, 3)).as_quat().reshape(*turns.shape[:2], 4)
        twist = 2.0 * np.arctan2(np.sum(quaternion[:, :, :3] * inwards, axis=2), quaternion[:, :, 3])
        spin = np.abs(np.remainder(twist + math.pi, 2.0 * math.pi) - math.pi)
        return np.stack([np.linalg.norm(aside, axis=2), spin], axis=2)
