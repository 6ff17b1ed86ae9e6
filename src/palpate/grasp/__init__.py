"""The forces of a grasp: the least that hold a load, under friction and spin limits."""

from palpate.grasp.closure import force_closure, internal_forces
from palpate.grasp.contacts import GraspContacts
from palpate.grasp.disturbance import largest_disturbance, worst_disturbance
from palpate.grasp.from_touch import grasp_from_touch
from palpate.grasp.objective import Objective
from palpate.grasp.optimizer import GraspForceOptimizer
from palpate.grasp.result import GraspForces, SolveStatus
from palpate.grasp.robust import RobustLeastEffort
from palpate.grasp.sensitivity import grip_sensitivity
from palpate.grasp.uncertainty import GraspUncertainty

__all__ = [
    "GraspContacts",
    "GraspForceOptimizer",
    "GraspForces",
    "GraspUncertainty",
    "Objective",
    "RobustLeastEffort",
    "SolveStatus",
    "force_closure",
    "grasp_from_touch",
    "grip_sensitivity",
    "internal_forces",
    "largest_disturbance",
    "worst_disturbance",
]
