"""What pressing has found, as an exploration's force control goes by it, and as text for its log."""

from dataclasses import dataclass

from palpate.controllers import Admittance, DirectForce, ForceGain, ForceLaw, Identification, VirtualBody
from palpate.errors import check_not_negative, check_positive


@dataclass(frozen=True, slots=True)
class IdentifiedForce:
    """The law of force control that pressing has found, and the margins that it was measured to have.

    Attributes:
        contact_stiffness: K of the contact alone [N/m].
        contact_stiffness_sd: Its standard deviation [N/m].
        series_stiffness: Of contact and servo [N/m].
        delay: Of a delayed integrator with the law's k K T [s].
        damping: Steady force error per velocity, 1 / k [N s/m].
        mass: Of the virtual body [kg]; 0: the law is the direct one.
        gain_margin: By which factor the response may grow before the loop oscillates.
        phase_margin_deg: [degrees].
    """

    contact_stiffness: float
    contact_stiffness_sd: float
    series_stiffness: float
    delay: float
    damping: float
    mass: float
    gain_margin: float
    phase_margin_deg: float

    def __post_init__(self) -> None:
        check_positive(self, **_UNITS)
        check_not_negative(self, contact_stiffness_sd="N/m", mass="kg")

    @classmethod
    def of(cls, found: Identification) -> "IdentifiedForce":
        """Return the better of the laws that an identification gives."""
        contact, better = found.stiffness, found.admittance
        if better is None:
            gain = found.gain
            return cls(
                contact.value, contact.sd, gain.stiffness, gain.delay, 1.0 / gain.gain, 0.0,
                gain.gain_margin, found.phase_margin_deg,
            )  # fmt: skip
        body = better.body
        return cls(
            contact.value, contact.sd, body.stiffness, body.delay, body.damping, body.mass,
            better.gain_margin, better.phase_margin_deg,
        )  # fmt: skip

    @property
    def gain(self) -> ForceGain:
        """Velocity per steady force error."""
        return ForceGain(1.0 / self.damping, self.series_stiffness, self.delay)

    def law(self, period: float) -> ForceLaw:
        """Return a fresh law for a control period [s]."""
        if self.mass == 0.0:
            return DirectForce(self.gain)
        return Admittance(VirtualBody(self.mass, self.damping, self.series_stiffness, self.delay), period)


_UNITS = {
    "contact_stiffness": "N/m",
    "series_stiffness": "N/m",
    "delay": "s",
    "damping": "N s/m",
    "gain_margin": "",
    "phase_margin_deg": "degrees",
}
