"""The solvers compared, what each needs, and how far each is worth waiting for."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec

from grasp_forces.casadi_solvers import (
    FATROP,
    IPOPT_DEFAULT,
    IPOPT_KEPT,
    IPOPT_SQUARED,
    SQP_DAQP,
    SQP_OSQP,
    SQP_QPOASES,
    SQP_QRQP,
    Nlp,
    SuperScs,
)
from grasp_forces.cone_form import ClarabelDirect, Ecos, Scs
from grasp_forces.facets import FacetsDaqp
from grasp_forces.modelled import Cvxpy
from grasp_forces.ours import DualNewton, Optimizer
from grasp_forces.problem import Problem, Solver
from grasp_forces.slsqp import Slsqp
from palpate.grasp import Objective

SIZES = (2, 3, 4, 5, 10, 100, 1000)


@dataclass(frozen=True, slots=True)
class Method:
    """A solver of min_effort.

    Attributes:
        name: For table and picture.
        prepare: Grasp -> solver.
        most_contacts: Where it stops being worth the wait, or fails: see `tables.EXPLANATION`.
        every: Of the hard instances, it is given one in so many.
        package: What pip would install, if it is none that palpate's own tests need.
    """

    name: str
    prepare: Callable[[Problem], Solver]
    most_contacts: int = 1000
    every: int = 1
    package: str | None = None

    @property
    def installed(self) -> bool:
        return self.package is None or find_spec(self.package) is not None


EFFORT = Objective.MIN_EFFORT
NEWTON = Method("dual Newton alone", DualNewton)
OPTIMIZER = Method("GraspForceOptimizer", partial(Optimizer, objective=EFFORT))
CLARABEL = Method("clarabel direct", partial(ClarabelDirect, objective=EFFORT))
METHODS = (
    NEWTON,
    OPTIMIZER,
    CLARABEL,
    Method("ecos", Ecos, package="ecos"),
    Method("scs", Scs, 100, 5, package="scs"),
    Method("cvxpy + clarabel", Cvxpy, 100, 5, package="cvxpy"),
    Method("ipopt, bounds kept", partial(Nlp, setting=IPOPT_KEPT), 10, 5),
    Method("ipopt, default", partial(Nlp, setting=IPOPT_DEFAULT), 10, 5),
    Method("ipopt, squared cones", partial(Nlp, setting=IPOPT_SQUARED), 100, 5),
    Method("sqpmethod + qrqp", partial(Nlp, setting=SQP_QRQP), 10, 5),
    Method("sqpmethod + daqp", partial(Nlp, setting=SQP_DAQP), 10, 5),
    Method("sqpmethod + osqp", partial(Nlp, setting=SQP_OSQP), 10, 5),
    Method("sqpmethod + qpoases", partial(Nlp, setting=SQP_QPOASES), 10, 5),
    Method("fatrop", partial(Nlp, setting=FATROP), 10, 5),
    Method("superscs", SuperScs, 10, 20),
    Method("16 facets + daqp", FacetsDaqp, 10, package="daqp"),
    Method("scipy SLSQP", Slsqp, 10, 5),
)


def of_objective(objective: Objective) -> tuple[Method, ...]:
    """Return those that solve any objective."""
    return (
        Method(OPTIMIZER.name, partial(Optimizer, objective=objective)),
        Method(CLARABEL.name, partial(ClarabelDirect, objective=objective)),
    )
