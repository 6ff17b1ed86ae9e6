"""At which forces and speeds the supervisor would stop a run, and how hard it may press all the same."""

from palpate.controllers import LandingModel
from palpate.reporting.data import Quantity
from palpate.runtime import Limits


def limit_quantities(limits: Limits, landing: LandingModel) -> tuple[Quantity, ...]:
    """Return the limits of force and speed, and the largest force that they allow, for a dry run.

    Args:
        limits: For the supervisor.
        landing: On the contact that is expected.
    """
    speed, stiffness = limits.commanded_speed, landing.contact_stiffness
    largest = landing.largest_force(speed, limits.force)
    return (
        Quantity("force limit", limits.force, "N", "of the supervisor, which then draws back"),
        Quantity("speed limit", 1e3 * speed, "mm/s", "of the supervisor, for what is commanded near a contact"),
        Quantity(
            "largest force",
            largest,
            "N",
            f"{largest / limits.force:.2g} times the limit: with which something unexpected of {stiffness:g} N/m "
            "may be hit at the speed limit",
            digits=3,
        ),
    )
