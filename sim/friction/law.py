"""Dry friction that MuJoCo's contact law cannot show, and its closed form in full slip.

A contact with normal force f_n bears a tangential force f_t and a torque tau about the normal up to the limit
surface

    |(f_t / mu f_n, tau / mu e f_n)|_p = 1,    e = c f_n^gamma

(`palpate.friction.LimitSurface`), and slips along its normal. The slip speed v = |(v_t, e omega)|_q,
1/p + 1/q = 1, is the dissipated power over mu f_n, and for p = 2 just sqrt(v_t^2 + e^2 omega^2). With it
(Armstrong-Helouvry, Dupont, Canudas de Wit 1994)

    mu(v) = mu_k + (mu_s - mu_k) exp(-(v/v_s)^2) + viscous v.
"""

import math
from dataclasses import dataclass

from palpate.errors import InvalidValueError, check_positive, not_negative
from palpate.friction import LimitSurface
from palpate.friction.p_norm import dual_point


@dataclass(frozen=True, slots=True)
class FrictionLaw:
    """How two bodies rub. Until they slip they hang together by an elastic bristle.

    Attributes:
        static_friction: mu_s, at which slip begins.
        kinetic_friction: mu_k, of fast slip.
        stribeck_speed: v_s [m/s]: how fast mu falls from static to kinetic.
        viscous_friction: Growth of mu with the slip speed [s/m].
        spin_length: c [m], which is e at 1 N.
        load_exponent: gamma, 0 to 1/3.
        norm_exponent: p, 1 to 2.
        stiffness: Tangential stiffness K of the bristle [N/m]; about the normal it is K spin_length^2. Where a
            pair of geoms touches at several points they share it, so the travel before slip is mu f_n / K in
            both cases. Of two elastic bodies it is 2/3 to 1 of the normal stiffness (Mindlin 1949).
        damping_ratio: Of the bristle with the mass of the bodies on it.
    """

    static_friction: float = 0.3
    kinetic_friction: float = 0.3
    stribeck_speed: float = 0.01
    viscous_friction: float = 0.0
    spin_length: float = 0.004
    load_exponent: float = 0.0
    norm_exponent: float = 2.0
    stiffness: float = 20e3
    damping_ratio: float = 0.3

    def __post_init__(self) -> None:
        check_positive(
            self, static_friction="", kinetic_friction="", stribeck_speed="m/s", stiffness="N/m", damping_ratio=""
        )
        not_negative("viscous_friction", self.viscous_friction, "s/m")
        if self.kinetic_friction > self.static_friction:
            raise InvalidValueError(
                f"kinetic_friction = {self.kinetic_friction:g}: must be at most the static_friction = "
                f"{self.static_friction:g}; for friction that grows with speed give viscous_friction"
            )
        self.limit_surface(self.static_friction)  # refuses the other three
        if self.norm_exponent > 2.0:
            raise InvalidValueError(
                f"norm_exponent = {self.norm_exponent:g}: must lie between 1 (diamond) and 2 (ellipsoid) "
                "to be simulated"
            )

    def limit_surface(self, friction: float) -> LimitSurface:
        """Return what is borne at a friction mu, such as `static_friction` or `friction_at(speed)`."""
        return LimitSurface(friction, self.spin_length, self.load_exponent, self.norm_exponent)

    def friction_at(self, slip_speed: float) -> float:
        """Return mu at a slip speed [m/s]."""
        drop = math.exp(-((slip_speed / self.stribeck_speed) ** 2))
        kinetic, static = self.kinetic_friction, self.static_friction
        return kinetic + (static - kinetic) * drop + self.viscous_friction * slip_speed

    def spin_length_at(self, normal_force: float) -> float:
        """Return e [m] at a normal force [N]."""
        return self.limit_surface(self.static_friction).spin_length_at(normal_force)

    def load_ratio(
        self, normal_force: float, tangential_force: float, spin_torque: float, friction: float
    ) -> float:
        """Return the norm of a load that is 1 on the limit surface.

        Args:
            normal_force: [N], above 0.
            tangential_force: Its length [N].
            spin_torque: [N m].
            friction: The coefficient mu to take.
        """
        return self.limit_surface(friction).load_ratio(normal_force, tangential_force, spin_torque)

    def slip_speed(self, normal_force: float, speed: float, spin: float) -> float:
        """Return v [m/s]: dissipated power over mu f_n of a slip at `speed` [m/s] and `spin` [rad/s]."""
        a, b = abs(speed), self.spin_length_at(normal_force) * abs(spin)
        x, y = dual_point(a, b, self.norm_exponent)
        return a * x + b * y

    def slipping_load(self, normal_force: float, speed: float, spin: float) -> tuple[float, float]:
        """Return what a contact in full slip bears: the load on the limit surface whose normal the slip is.

        Args:
            normal_force: [N].
            speed: Of the slip along the surface [m/s], 0 or above.
            spin: Of the slip about the normal [rad/s].

        Returns:
            Tangential force along the slip [N], spin torque along the spin [N m].
        """
        e = self.spin_length_at(normal_force)
        x, y = dual_point(abs(speed), e * abs(spin), self.norm_exponent)
        most = self.friction_at(self.slip_speed(normal_force, speed, spin)) * normal_force
        return most * x, math.copysign(most * e * y, spin)
