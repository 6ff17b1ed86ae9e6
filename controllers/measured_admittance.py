"""An admittance from a measured frequency response, where it bears more than the direct law.

A damped contact responds to a fast motion with c v, however short all delays are: k c < 1 limits the direct law,
as if it were a delay c / K. An admittance does not respond to what is fast; its lag takes back the lead that the
damping gives, and the gain may grow until the true delays limit it.
"""

import math
from dataclasses import dataclass

import numpy as np

from palpate.controllers.force_law import VirtualBody
from palpate.controllers.gains import LOOP_GAIN, ForceGain
from palpate.controllers.measured_loop import ForceResponse

LAGS = tuple(np.geomspace(0.003, 0.1, 15).tolist())
"""That are tried [s]: from a few periods of control to beyond c / K of a contact that is damped by what moves."""

STIFFER = 3.0
"""A contact that is stiffer by this factor than the one that was pressed on"""

MIN_PHASE_MARGIN = 30.0
"""must leave this phase margin [degrees]."""

DISTURBANCE = 2.0 * math.pi * 5.0
"""[rad/s] Where laws are compared by their gain: friction that turns at a path's corner, and a slope met at
20 mm/s, disturb a contact within 50 to 100 ms."""

WORTHWHILE = 1.2
"""By which factor an admittance must be better."""


@dataclass(frozen=True, slots=True)
class MeasuredAdmittance:
    """A law, and the margins that it was measured to have.

    Attributes:
        body: For `palpate.controllers.Admittance`. Its delay is the one of a delayed integrator with this k K T.
        gain_margin: By which factor the response may grow before the loop oscillates; a lower bound if it does not
            do so within what was measured.
        phase_margin_deg: [degrees].
        stiffer_phase_margin_deg: Likewise, where the response is `STIFFER` times as large.
    """

    body: VirtualBody
    gain_margin: float
    phase_margin_deg: float
    stiffer_phase_margin_deg: float

    @property
    def gain(self) -> ForceGain:
        """Velocity per steady force error."""
        return self.body.gain


def measured_admittance(
    response: ForceResponse, series_stiffness: float, loop_gain: float = LOOP_GAIN
) -> MeasuredAdmittance | None:
    """Return the admittance with the largest response at `DISTURBANCE`; None if the direct law does as well.

    Args:
        response: As measured.
        series_stiffness: Of contact and servo [N/m].
        loop_gain: k K T of a delayed integrator that has the wanted margins.
    """
    found = [(lag, _gain(response, loop_gain, lag)) for lag in LAGS]
    lag, gain = max(found, key=lambda one: _response(one[1], one[0]))
    if _response(gain, lag) < WORTHWHILE * response.gain(loop_gain):
        return None
    _, critical = response.oscillation(lag)
    delay = loop_gain / (gain * series_stiffness)
    try:
        body = VirtualBody(lag / gain, 1.0 / gain, series_stiffness, delay)
    except ValueError:  # stable as measured, but not on a spring without damping
        return None
    return MeasuredAdmittance(
        body,
        critical / gain,
        response.phase_margin_deg(gain, lag),
        response.phase_margin_deg(STIFFER * gain, lag),
    )


def _gain(response: ForceResponse, loop_gain: float, lag: float) -> float:
    gain = response.gain(loop_gain, lag)
    for _ in range(60):
        if response.phase_margin_deg(STIFFER * gain, lag) >= MIN_PHASE_MARGIN:
            break
        gain *= 0.95
    return gain


def _response(gain: float, lag: float) -> float:
    return gain / math.hypot(1.0, DISTURBANCE * lag)
