"""A grip shared among two, three or more fingers: the least that together holds the object.

All wrenches that the fingers feel, brought into the hand's frame, add up to what pulls at the object: weight,
inertia and whatever else, with no need to know any of it. For that load, and for the one that comes, the least
normal forces are found that hold it within all limits together, however friction is shared now
(`palpate.grasp`). They are what is commanded; friction then bears what it has to. It need not be as the solution
has it: if forces within the limits balance the load at all, rigid bodies with friction find some that do, where
contacts at their limit creep a few micrometres and hand their part to the others (the lower-bound theorem of limit
analysis; exact where friction is associated, and near to it else).
"""

import math
from dataclasses import replace

import numpy as np

from palpate.controllers.grip.belief import SurfaceBelief
from palpate.controllers.grip.grasp_solver import GraspSolver, MinimumGrip
from palpate.controllers.grip.grip_plan import Loads
from palpate.controllers.grip.parameters import GripParameters
from palpate.controllers.grip.wrench_ahead import WrenchAhead
from palpate.errors import FloatArray, positive
from palpate.grasp.problem.contacts import GraspContacts
from palpate.grasp.problem.from_touch import contact_place, force_on_object
from palpate.grasp.problem.inscribed import inscribed
from palpate.kinematics.hand import HandKinematics
from palpate.kinematics.pose import Pose
from palpate.runtime.data import Observation
from palpate.spatial import ZERO, Wrench, add, cross, rotate

SHARED = GripParameters(reserve=0.02, play=0.16, correction_down=0.0)
"""Safe defaults where fingers press differently. Noise of what is wanted has a standard deviation of 0.03 N with
sensors of a Nano17's class, and what it was at its highest is kept: that needs little reserve beside."""

RAISED = 1e-3
"""[N] By which forces must be more than wanted before others are asked to balance it: less than any noise."""


class SharedGrip:
    """Each finger presses with its share of the least grip that holds the whole load. A `GripPlan`."""

    def __init__(
        self,
        fingers: int,
        belief: SurfaceBelief,
        period: float,
        hand: HandKinematics,
        parameters: GripParameters | None = None,
        solver: GraspSolver | None = None,
        trusted: float = math.inf,
    ) -> None:
        """Take the pieces.

        Args:
            fingers: How many there are.
            belief: What the contacts bear.
            period: Of control [s].
            hand: Where the fingertips are.
            parameters: How loads are followed, and the largest grip; safe defaults if not given.
            solver: Finds the forces; the least by what is believed if not given.
            trusted: Normal force up to which e is taken to grow, where it does [N]: the largest that it was
                measured with.
        """
        p = parameters or SHARED
        self._belief, self._hand, self._solver = belief, hand, solver or MinimumGrip(fingers)
        self._lead, self._largest = p.lead, p.largest_grip
        self._ahead = WrenchAhead(p.smoothing, period)
        self._fingers, self._trusted = fingers, positive("trusted", trusted, "N", infinite_allowed=True)
        self.start()

    def start(self) -> None:
        """See `GripPlan`."""
        self._ahead.restart()
        self._grasp: GraspContacts | None = None
        self._load = np.zeros(6)
        self._planned: FloatArray | None = None
        self._wanted = self.needed = (0.0,) * self._fingers

    def wanted(self, now: Observation, loads: Loads, margin: float, missing: float = 1.0) -> tuple[float, ...]:
        """See `GripPlan`; while a finger feels nothing to be believed, the last that was wanted."""
        if now.hand is None or None in loads:
            self._ahead.restart()
            self._grasp = None
            return self._wanted
        poses = self._hand.sensor_poses(now.hand.joint_position)
        self._ahead.step(_load(now, poses))
        self._load = missing * self._ahead.ahead(self._lead)
        grasp = self._grasp = self._contacts(now, poses, margin)
        present = self._solver.forces(grasp, missing * self._ahead.ahead(0.0))
        later = self._solver.forces(grasp, self._load)
        if present is not None:
            self.needed = tuple((present[:, 0] / (1.0 + margin)).tolist())
        if later is not None:
            self._planned = later
        both = [each[:, 0] for each in (present, later) if each is not None]
        if both:
            self._wanted = tuple(np.max(both, axis=0).tolist())
        return self._wanted

    def completed(self, forces: tuple[float, ...]) -> tuple[float, ...]:
        """See `GripPlan`: the least for that load again, with these for lower bounds."""
        if self._grasp is None or self._planned is None:
            return forces
        least = np.minimum(forces, self._largest)
        if (least <= self._planned[:, 0] + RAISED).all():
            return forces
        found = self._solver.forces(replace(self._grasp, force_min=least), self._load)
        return forces if found is None else tuple(np.maximum(found[:, 0], least).tolist())

    def missing(self, wanted: tuple[float, ...], felt: tuple[float, ...]) -> tuple[float, ...]:
        """See `GripPlan`: each for itself."""
        return tuple(aim - force for aim, force in zip(wanted, felt, strict=True))

    def _contacts(self, now: Observation, poses: tuple[Pose, ...], margin: float) -> GraspContacts:
        """The grasp of this period, hand frame: cones within what is believed, less the margin."""
        places = [
            contact_place(finger.contact).seen_from(pose) for finger, pose in zip(now.fingers, poses, strict=True)
        ]
        surfaces = [self._belief.surface(i) for i in range(self._fingers)]
        grasp = GraspContacts(
            [each.position for each in places],
            [each.frame for each in places],
            [each.friction / (1.0 + margin) for each in surfaces],
            [each.spin_length for each in surfaces],
            force_max=self._largest,
            load_exponent=[each.load_exponent for each in surfaces],
            norm_exponent=[each.norm_exponent for each in surfaces],
        )
        if grasp.is_convex:
            return grasp
        # cones that touch the limits where the last plan loads them: from period to period they follow it
        loaded = self._planned
        if loaded is None:
            loaded = np.array([force_on_object(finger.contact) for finger in now.fingers])
        loaded = loaded.copy()
        loaded[:, 0] = np.minimum(loaded[:, 0], self._trusted)
        return inscribed(grasp, loaded)


def _load(now: Observation, poses: tuple[Pose, ...]) -> Wrench:
    """What pulls at the object, hand frame, about its origin [N, N m]: what all fingers feel of it."""
    force, moment = ZERO, ZERO
    for finger, pose in zip(now.fingers, poses, strict=True):
        a, b, c, d, e, f = finger.wrench
        its = rotate(pose.rotation, (a, b, c))
        force = add(force, its)
        moment = add(moment, add(rotate(pose.rotation, (d, e, f)), cross(pose.position, its)))
    return (*force, *moment)
