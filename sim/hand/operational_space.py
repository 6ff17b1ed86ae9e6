"""Torques of a finger whose tip presses along one direction and moves in the others, compiled.

Operational-space control (Khatib 1987). With A the Jacobian of the tip's centre, shape (3, m), along axes of which
x is the direction in which the finger closes, M the finger's inertia and W = A M^-1 A', a free tip follows its
reference by

    tau = bias + A' (W + eps)^-1 (b^2 e + 2 b e')

so that every direction has the natural frequency b, critically damped, whatever the posture. A tip that presses
has along x that law's force clipped to the grip force, its reference running ahead with the closing speed, and in
the null space of that task (dynamically consistent) the same law for y and z. What joints can do besides is damped
alone. eps bounds the torques near singularities.
"""

import numpy as np

from palpate.compiling import njit
from palpate.kinematics.kernel import tip_frame, tip_jacobian

_SINGULAR = 1e-4
"""eps over the trace of W: a hundredth of the mean singular value, where motion is given up by halves."""

_LEAD = 2.0
"""Times the grip force that the reference of a finger at rest on an object may ask for: the clip decides."""


@njit(error_model="numpy", cache=True)
def finger_torque(chain, axes, q, rate, inertia, bias, reference, velocity, law, speed_limit, torque_limit, dt):
    """Return joint torques, shape (m,), and write the reference of the next time step.

    Args:
        chain: From the hand frame to the tip's centre, as `palpate.kinematics.kernel` packs it.
        axes: In which it closes, and two square to that: rows, hand frame, shape (3, 3).
        q: Joint positions, shape (m,) [rad or m].
        rate: Joint velocities.
        inertia: Joint-space inertia, shape (m, m).
        bias: Torques that keep the finger where it is, gravity's above all, shape (m,).
        reference: Of the tip's centre, hand frame, shape (3,) [m]; written.
        velocity: Wanted, sensor frame, shape (3,) [m/s].
        law: Grip force [N], below 0: it does not press; closing speed [m/s], natural frequency [rad/s], largest
            following error [m].
        speed_limit: Of each joint.
        torque_limit: Of each joint.
        dt: Time step [s].
    """
    m = len(q)
    force, closing_speed, b, follow = law[0], law[1], law[2], law[3]
    frame = tip_frame(chain, q)
    R = frame[3:].copy().reshape(3, 3)
    A = axes @ tip_jacobian(chain, q)[:3].copy()
    moved = A @ rate
    mobility = np.linalg.inv(inertia)
    W = A @ mobility @ A.T
    eps = _SINGULAR * np.trace(W)
    Wi = np.linalg.inv(W + eps * np.eye(3))
    # all joints keep to their speeds: the motion is slowed down as a whole
    wanted = axes @ (R @ velocity)
    if force >= 0.0:
        wanted[0] = closing_speed
    asked = mobility @ (A.T @ (Wi @ wanted))
    slower = 1.0
    for k in range(m):
        slower = max(slower, abs(asked[k]) / speed_limit[k])
    wanted /= slower
    e = axes @ (reference - frame[:3])
    if force >= 0.0:
        mass = 1.0 / max(W[0, 0], eps)
        e[0] = min(max(e[0], -follow), _LEAD * force / (mass * b * b))
        pressed = mass * (b * b * e[0] + 2.0 * b * (wanted[0] - moved[0]))
        tau = A[0] * min(max(pressed, -force), force)
        aside = np.hypot(e[1], e[2])
        if aside > follow:
            e[1:] *= follow / aside
        B = A[1:].copy()
        for i in range(2):
            B[i] -= W[1 + i, 0] * mass * A[0]
        a = b * b * e[1:] + 2.0 * b * (wanted[1:] - moved[1:])
        tau += B.T @ (np.linalg.inv(B @ mobility @ B.T + eps * np.eye(2)) @ a)
    else:
        length = np.sqrt(np.sum(e * e))
        if length > follow:
            e *= follow / length
        tau = A.T @ (Wi @ (b * b * e + 2.0 * b * (wanted - moved)))
    reference[:] = frame[:3] + axes.T.copy() @ (e + dt * wanted)
    # joints that the tip leaves free
    free = rate - mobility @ (A.T @ (Wi @ moved))
    tau += bias - b * (inertia @ free)
    for k in range(m):
        tau[k] = min(max(tau[k], -torque_limit[k]), torque_limit[k])
    return tau
