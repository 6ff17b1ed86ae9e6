"""What palpate leaves out of an arm's file, and what it takes for what the file does not say: in sentences."""

from collections.abc import Mapping, Sequence

import mujoco

from palpate.kinematics import JointKind
from palpate.sim.carriers.arm_checks import turns_on
from palpate.sim.carriers.arm_model import ASSUMED_ARMATURE

_SHOWN = 4
"""Names in a sentence; a humanoid has forty joints beside an arm."""


def assumptions(
    model: mujoco.MjModel, joints: Sequence[int], mended: Mapping[str, Sequence[str]]
) -> tuple[str, ...]:
    """Return them.

    Args:
        model: All that is in the file.
        joints: Of the arm, by number.
        mended: What was done before, with whom.
    """
    light = [model.joint(i).name for i in joints if not model.dof_armature[model.jnt_dofadr[i]]]
    armature = f"{ASSUMED_ARMATURE[JointKind.HINGE]:g} kg m^2 or {ASSUMED_ARMATURE[JointKind.SLIDE]:g} kg"
    found = {
        "no joints of the arm, left where the file has them": [
            model.joint(i).name for i in range(model.njnt) if i not in joints
        ],
        "without end in the file, taken to turn by 360 deg to either side": [
            model.joint(i).name for i in joints if turns_on(model, i)
        ],
        f"without armature in the file, {armature} assumed": light,
        **mended,
    }
    return tuple(f"{words}: {_listed(names)}" for words, names in found.items() if names)


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return ", ".join(names[:_SHOWN]) + more
