"""The forces of a grasp: the least that hold a load, under friction and spin limits."""

from palpate.grasp.contacts import GraspContacts
from palpate.grasp.optimizer import GraspForceOptimizer
from palpate.grasp.result import GraspForces, SolveStatus
from palpate.grasp.statement import Objective

__all__ = ["GraspContacts", "GraspForceOptimizer", "GraspForces", "Objective", "SolveStatus"]
