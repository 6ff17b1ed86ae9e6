"""The solvers compared, what each needs, and how far each is worth waiting for."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from typing import Any

from harness.study import Method

from grasp_forces.cone_form import ClarabelDirect, Cvxpy, Ecos, FacetsDaqp, Scs
from grasp_forces.nonlinear import (
    FATROP,
    IPOPT_DEFAULT,
    IPOPT_KEPT,
    IPOPT_SQUARED,
    SQP_DAQP,
    SQP_OSQP,
    SQP_QPOASES,
    SQP_QRQP,
    Nlp,
    Slsqp,
    SuperScs,
)
from grasp_forces.ours import DualNewton, Optimizer
from palpate.grasp import Objective


@dataclass(frozen=True, slots=True)
class GraspMethod(Method):
    """A solver of grasp forces; `prepare` takes a `Problem` and returns a `Solver`.

    Attributes:
        most_contacts: Largest grasp that it solves within seconds.
        every: It receives one in so many of the hard grasps.
        package: Package to install, if palpate's tests do not need it.
    """

    prepare: Callable[[Any], Any]
    most_contacts: int = 1000
    every: int = 1
    package: str | None = None

    @property
    def installed(self) -> bool:
        """Whether its package can be imported."""
        return self.package is None or find_spec(self.package) is not None


EFFORT = Objective.MIN_EFFORT
NEWTON = GraspMethod("dual Newton alone", DualNewton)
OPTIMIZER = GraspMethod("GraspForceOptimizer", partial(Optimizer, objective=EFFORT))
CLARABEL = GraspMethod("clarabel direct", partial(ClarabelDirect, objective=EFFORT))
SLSQP = GraspMethod("scipy SLSQP", Slsqp, most_contacts=10, every=5)
PROGRAMMES = {
    "ipopt, bounds kept": IPOPT_KEPT,
    "ipopt, default": IPOPT_DEFAULT,
    "ipopt, squared cones": IPOPT_SQUARED,
    "sqpmethod + qrqp": SQP_QRQP,
    "sqpmethod + daqp": SQP_DAQP,
    "sqpmethod + osqp": SQP_OSQP,
    "sqpmethod + qpoases": SQP_QPOASES,
    "fatrop": FATROP,
}
METHODS = (
    NEWTON,
    OPTIMIZER,
    CLARABEL,
    GraspMethod("ecos", Ecos, package="ecos"),
    GraspMethod("scs", Scs, most_contacts=100, every=5, package="scs"),
    GraspMethod("cvxpy + clarabel", Cvxpy, most_contacts=100, every=5, package="cvxpy"),
    *(
        GraspMethod(name, partial(Nlp, setting=setting), most_contacts=100 if "squared" in name else 10, every=5)
        for name, setting in PROGRAMMES.items()
    ),
    GraspMethod("superscs", SuperScs, most_contacts=10, every=20),
    GraspMethod("16 facets + daqp", FacetsDaqp, most_contacts=10, package="daqp"),
    SLSQP,
)


def of_objective(objective: Objective) -> tuple[GraspMethod, ...]:
    """Return those that solve any objective."""
    return (
        GraspMethod(OPTIMIZER.name, partial(Optimizer, objective=objective)),
        GraspMethod(CLARABEL.name, partial(ClarabelDirect, objective=objective)),
    )
