"""The forces of a grasp: the least that hold a load, under friction and spin limits.

`state_contact` and `cone_margin` are imported when they are first used: with CasADi, which takes a second.
"""

from typing import TYPE_CHECKING, Any

from palpate.grasp.certificates.closure import force_closure, internal_forces
from palpate.grasp.certificates.disturbance import largest_disturbance, worst_disturbance
from palpate.grasp.certificates.sensitivity import grip_sensitivity
from palpate.grasp.optimizer import GraspForceOptimizer
from palpate.grasp.problem.contacts import GraspContacts
from palpate.grasp.problem.from_touch import grasp_from_touch
from palpate.grasp.problem.objective_spec import Objective
from palpate.grasp.problem.result import GraspForces, SolveStatus
from palpate.grasp.robust.least_effort import RobustForces, RobustLeastEffort
from palpate.grasp.robust.sampled_holding import SampledHolding, sample_holding
from palpate.grasp.robust.uncertainty import GraspUncertainty

if TYPE_CHECKING:
    from palpate.grasp.problem.statement import ContactStatement, cone_margin, state_contact

__all__ = [
    "ContactStatement",
    "GraspContacts",
    "GraspForceOptimizer",
    "GraspForces",
    "GraspUncertainty",
    "Objective",
    "RobustForces",
    "RobustLeastEffort",
    "SampledHolding",
    "SolveStatus",
    "cone_margin",
    "force_closure",
    "grasp_from_touch",
    "grip_sensitivity",
    "internal_forces",
    "largest_disturbance",
    "sample_holding",
    "state_contact",
    "worst_disturbance",
]


def __getattr__(name: str) -> Any:
    if name in ("ContactStatement", "cone_margin", "state_contact"):
        from palpate.grasp.problem import statement

        return getattr(statement, name)
    raise AttributeError(f"module 'palpate.grasp' has no attribute {name!r}")
