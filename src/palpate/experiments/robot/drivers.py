"""Whether this computer can drive a robot at all: said before a run makes its folder."""

from palpate.experiments.robot.values import load_named_robot
from palpate.hw.ur.support import refuse_unsupported
from palpate.runtime.robot_backend import EmulatedHandEntry, EmulatedUr5eEntry
from palpate.runtime.robot_rig import RigEntry


def check_drivers(name: str | None) -> None:
    """Refuse a robot whose client library does not exist for this computer.

    Args:
        name: Of a shipped robot, or the path of a robot file; None: a simulation.

    Raises:
        InvalidValueError: There is no such robot.
        MissingLibraryError: It has a UR arm, and this computer has no ur_rtde.
    """
    if name is None:
        return
    backend = load_named_robot(name).file.backend
    if isinstance(backend, EmulatedUr5eEntry | EmulatedHandEntry) or (
        isinstance(backend, RigEntry) and backend.arm is not None
    ):
        refuse_unsupported()
