"""Servo references of an arm in a control period, compiled."""

from palpate.compiling import njit


@njit(error_model="numpy", cache=True)
def ramp_servos(actual, before, reference, lead, reach, steps, control, ramp):
    """Write where the servos' references begin a control period, and by how much they move per time step.

    A ramp, not stairs, whose ripple would break friction; nothing lies so far that it makes a joint faster than it
    may be.

    Args:
        actual: Where the joints are [rad or m], shape (n,).
        before: Joint references before the period [rad or m], shape (n,).
        reference: At its end, and their feed-forward [rad/s or m/s], shape (2 n,) or longer.
        lead: Of the servos [s].
        reach: Farthest from `actual` [rad or m], shape (n,).
        steps: Time steps in the period.
        control: To write the first reference into, shape (n,).
        ramp: To write the step into, shape (n,).
    """
    n = len(actual)
    for k in range(n):
        q, ahead = actual[k], lead * reference[n + k]
        start = min(max(before[k] + ahead, q - reach[k]), q + reach[k])
        end = min(max(reference[k] + ahead, q - reach[k]), q + reach[k])
        control[k], ramp[k] = start, (end - start) / steps
