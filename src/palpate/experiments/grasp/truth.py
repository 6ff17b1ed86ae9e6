"""What really happened in a grasp, kept beside what was sensed, one row per period."""

import math
from array import array
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.controllers.grip.grasp import GraspController, GraspStage
from palpate.errors import FloatArray
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.hand_motion import HandMotion, OverTips
from palpate.robots.hand_description import HandDescription
from palpate.runtime import Command, Observation, Sample
from palpate.runtime.truth import TruthSource, TruthTable


def clearance(config: GraspConfig, height: FloatArray, quat_wxyz: FloatArray) -> FloatArray:
    """Return the height of an object's lowest point above the table, shape (n,) [m]; 0 or less: it stands on it.

    Args:
        config: What is held; its origin is its centre, and stands half a height above the table at height 0.
        height: Of its origin, base frame, shape (n,) [m].
        quat_wxyz: Its orientation, object to base, shape (n, 4). A cylinder's axis is its x.
    """
    w, x, y, z = np.moveaxis(quat_wxyz, -1, 0)
    up = np.stack([2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)], axis=-1)
    sizes = config.sizes
    if config.object == "box":
        below = np.abs(up) @ (0.5 * np.array(sizes))
    elif config.object == "cylinder":
        below = 0.5 * sizes[1] * np.abs(up[..., 0]) + sizes[0] * np.sqrt(np.maximum(0.0, 1.0 - up[..., 0] ** 2))
    else:
        below = np.full(w.shape, sizes[0])
    lowest: FloatArray = height + config.half_height - below
    return lowest


STAGES = tuple(GraspStage)
NUMBERS = {stage: number for number, stage in enumerate(STAGES)}

OWN = 4
"""Columns that are kept of controller and command before the grip of each finger: time, stage, target, regrips."""


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
    """An observer that keeps the truth at every sample, of a back end or of a log; `truth` evaluates it."""

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
        self._own, self._numbers = array("d"), array("d")

    def __call__(self, sample: Sample, now: Observation, command: Command) -> None:
        """Append the truth that belongs to this sample."""
        stage, grip, force = self._controller.stage, self._controller.grip, command.grip_force
        letting_go = stage is GraspStage.LET_GO and force is not None
        target = max(force) if letting_go and force is not None else grip.target
        self._own.extend((now.time, NUMBERS[stage], target, grip.regrips, *(force or self._no_grip)))
        self._numbers.extend(self._source.truth_row())

    def truth(self) -> GraspTruth:
        """Return all that was appended so far."""
        columns, fingers = self._source.truth_columns, self._hand.fingers
        own = np.array(self._own).reshape(-1, OWN + fingers)
        table = TruthTable(columns, np.array(self._numbers).reshape(len(own), len(columns)))
        time, stage, motion = own[:, 0], own[:, 1].astype(np.intp), HandMotion.of(table, self._hand)
        over = OverTips(motion, self._period if self._rubbed else None)
        slip, spin = over.since(time >= self._from)
        slid, turned = over.since(stage == NUMBERS[GraspStage.LIFT])
        pressed = -np.sum(motion.force * motion.normal, axis=2)
        aside = np.linalg.norm(motion.force + pressed[:, :, None] * motion.normal, axis=2)
        return GraspTruth(
            time=time,
            stage=stage,
            touching=motion.touching,
            contact=motion.contact - motion.position[:, None],
            normal=motion.normal,
            loads=np.stack([pressed, aside, np.sum(motion.torque * motion.normal, axis=2)], axis=2),
            slip=slip,
            spin=spin,
            command=own[:, OWN:],
            target=own[:, 2],
            pull=motion.pull,
            height=motion.position[:, 2],
            clearance=clearance(self._config, motion.position[:, 2], motion.quat_wxyz),
            slid=slid,
            turned=turned,
            regrips=own[:, 3].astype(np.intp),
            quat_wxyz=motion.quat_wxyz,
            tip=motion.tip - motion.position[:, None],
            force=motion.force,
        )
