"""What a real hand felt in a grasp, in place of the unknown truth, one row per period."""

import math
from array import array

import numpy as np

from palpate.controllers.grip.grasp import GraspController, GraspStage
from palpate.errors import FloatArray
from palpate.experiments.grasp.truth import STAGES, GraspTruth
from palpate.kinematics.pose import Pose
from palpate.runtime import Command, Observation, Sample
from palpate.sim.hand.hand_model import HandModel
from palpate.spatial import ZERO, as_vector, norm, rotate

ALL = 5
"""Columns of all fingers together: time, stage, target, height, and regrips."""

PER_FINGER = 14
"""Columns: touching; normal force, length of the tangential force, spin torque; commanded grip; contact and middle
of the fingertip, base frame, from the hand's origin, and the force on it."""


class GraspFeltRecorder:
    """An observer that keeps what fingers feel. What only a simulation knows is NaN."""

    def __init__(self, controller: GraspController, hand: HandModel) -> None:
        """Watch a controller's stage and target, and the fingers of a hand."""
        self._controller, self._hand = controller, hand
        self._rows = array("d")

    def __call__(self, sample: Sample, now: Observation, command: Command) -> None:
        """Append what belongs to this sample."""
        controller, commanded = self._controller, command.grip_force
        letting_go = controller.stage is GraspStage.LET_GO and commanded is not None
        row = [
            now.time,
            STAGES.index(controller.stage),
            max(commanded) if letting_go and commanded is not None else controller.grip.target,
            now.arm.position_base_tip[2],
            controller.grip.regrips,
        ]
        assert now.hand is not None  # it is what grasps
        base_hand = Pose(rotation=now.arm.rotation_base_tip)
        sensors = self._hand.sensor_poses(now.hand.joint_position)
        for i, (finger, tip, its) in enumerate(zip(now.fingers, self._hand.tips, sensors, strict=True)):
            contact, felt, base_sensor = finger.contact, finger.touching, base_hand @ its
            x, y, z = contact.tangential_force.tolist()
            loads = (contact.normal_force, norm((x, y, z)), contact.spin_torque) if felt else (0.0, 0.0, 0.0)
            middle = (base_sensor @ Pose(tip.center_of_mass)).position
            at = (base_sensor @ Pose(as_vector(contact.centroid))).position if finger.believed else middle
            row += [felt, *loads, math.nan if commanded is None else commanded[i]]
            row += [*at, *middle, *(rotate(base_sensor.rotation, finger.force) if felt else ZERO)]
        self._rows.extend(row)

    def truth(self) -> GraspTruth:
        """Return all that was appended so far: heights are the hand's, loads are as they were felt."""
        k = self._hand.fingers
        rows = np.array(self._rows).reshape(-1, ALL + k * PER_FINGER)
        each = rows[:, ALL:].reshape(-1, k, PER_FINGER)
        n = len(rows)
        return GraspTruth(
            time=rows[:, 0],
            stage=rows[:, 1].astype(np.intp),
            touching=each[:, :, 0].astype(bool),
            contact=each[:, :, 5:8],
            normal=_unknown(n, k, 3),
            loads=each[:, :, 1:4],
            slip=_unknown(n, k),
            spin=_unknown(n, k),
            command=each[:, :, 4],
            target=rows[:, 2],
            pull=_unknown(n, 6),
            height=rows[:, 3],
            clearance=_unknown(n),
            slid=_unknown(n, k),
            turned=_unknown(n, k),
            regrips=rows[:, 4].astype(np.intp),
            quat_wxyz=_unknown(n, 4),
            tip=each[:, :, 8:11],
            force=each[:, :, 11:14],
        )


def _unknown(*shape: int) -> FloatArray:
    return np.full(shape, np.nan)
