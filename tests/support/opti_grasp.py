"""A grasp stated for CasADi's Opti, in newtons and newton metres, by nothing of palpate's but the grasp itself."""

import casadi
import numpy as np


def opti_forces(grasp, load, objective, subject_to=None, shared_actuators=None, start=None):
    """Return the objective and the forces (n, 4) that IPOPT finds; friction limits are squared."""
    opti, n = casadi.Opti(), len(grasp)
    w = opti.variable(n, 4)
    packed = casadi.vec(w.T)
    opti.minimize(objective(w))
    opti.subject_to(casadi.DM(grasp.grasp_map) @ packed + load == 0)
    for i in range(n):
        opti.subject_to(opti.bounded(grasp.force_min[i], w[i, 0], grasp.force_max[i]))
        used = w[i, 1] ** 2 + w[i, 2] ** 2 + (w[i, 3] / grasp.spin_length[i]) ** 2
        opti.subject_to((grasp.friction[i] * w[i, 0]) ** 2 >= used)
    if shared_actuators is not None:
        rows, lower, upper = shared_actuators
        opti.subject_to(opti.bounded(lower, casadi.DM(rows) @ packed, upper))
    for each in subject_to(w) if subject_to else []:
        opti.subject_to(each)
    tight = {"tol": 1e-11, "constr_viol_tol": 1e-11, "bound_relax_factor": 0.0, "print_level": 0, "sb": "yes"}
    opti.solver("ipopt", {"print_time": False}, tight)
    opti.set_initial(w, np.tile([1.0, 0.01, 0.01, 0.0], (n, 1)) if start is None else start)
    found = opti.solve()
    return found.value(objective(w)), found.value(w)
