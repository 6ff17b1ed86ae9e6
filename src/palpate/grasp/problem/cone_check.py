"""Grasps whose limits are second-order cones and nothing else: the only ones that some methods cover."""

from palpate.errors import InvalidValueError
from palpate.grasp.problem.contacts import GraspContacts

__all__ = ["check_cones"]


def check_cones(grasp: GraspContacts, what: str) -> None:
    """Refuse a grasp beyond cones.

    Args:
        grasp: Any.
        what: That is known for cones only, for the message.

    Raises:
        InvalidValueError: Naming the attribute.
    """
    if (grasp.load_exponent > 0.0).any():
        raise InvalidValueError(
            f"load_exponent = {grasp.load_exponent.tolist()}: {what} known for cones alone; give e at the force "
            "expected as spin_length, with load_exponent = 0"
        )
    if (grasp.norm_exponent < 2.0).any():
        raise InvalidValueError(
            f"norm_exponent = {grasp.norm_exponent.tolist()}: {what} known for cones alone; with norm_exponent = "
            "2 and a friction smaller by 2^(1/2 - 1/p) no limit is exceeded"
        )
    if grasp.actuator_map is not None:
        raise InvalidValueError(
            f"actuator_map: {what} known for cones alone, without actuators; give what they bear as force_max"
        )
