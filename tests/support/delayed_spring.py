"""Force control against a spring when commands act late: the loop that gains and margins are made for."""

import math

import numpy as np


def delayed_loop(step, stiffness, delays, periods, period=1e-3, *, depth=0.0, surface=None, least=-math.inf):
    """Run a loop of force control; returns its forces [N].

    Args:
        step: Function of time [s], force [N] and velocity of the tip [m/s] to the commanded velocity [m/s].
        stiffness: Of the spring [N/m].
        delays: Number of periods after which a command acts.
        periods: Number of periods.
        period: Length of a period [s].
        depth: Of the tip in the spring at the start [m].
        surface: Function of time to the motion of the surface [m]; without it the surface is still.
        least: Lower bound of the force: 0 where the tip may leave the surface [N].
    """
    underway, velocity, forces = [0.0] * delays, 0.0, []
    for i in range(periods):
        forces.append(max(stiffness * (depth - (surface(i * period) if surface else 0.0)), least))
        underway.append(step(i * period, forces[-1], velocity))
        velocity = underway.pop(0)
        depth += period * velocity
    return np.array(forces)
