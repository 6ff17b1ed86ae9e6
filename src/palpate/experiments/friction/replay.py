"""A rubbing run planned again from its log, as it was or with something changed."""

from collections.abc import Mapping

from palpate.commands.replay.settings import Changeable, changed_config, robot_of
from palpate.experiments.friction.config import FrictionConfig
from palpate.experiments.friction.plan import FrictionPlan, plan
from palpate.experiments.friction.text import FRICTION_TEXT, read_friction_config

_FELT = "the samples are as recorded, on the surface that was rubbed"
_NOISY = "the samples are as recorded, with the noise that they have"

FIXED: Mapping[str, str] = {
    "object": _FELT,
    "size": _FELT,
    "friction": _FELT,
    "spin_length": _FELT,
    "norm_exponent": _FELT,
    "load_exponent": _FELT,
    "static_friction": _FELT,
    "stribeck_speed": _FELT,
    "viscous_friction": _FELT,
    "skin_stiffness": _FELT,
    "stiffness": _FELT,
    "drift": _NOISY,
    "force_noise": _NOISY,
    "moment_noise": _NOISY,
    "seed": _NOISY,
    "library": "a replay recognises nothing; rub again",
    "calibration": "a replay computes commands, and no intervals; rub again",
    "period": "the samples are as recorded, one per period",
    "out": "the run writes nothing again; --out says where the report goes",
}
"""Fields of `FrictionConfig` that no replay can change, and why."""

RUBBING = Changeable("a rubbing run", FrictionConfig, FIXED)


def planned_rubbing(texts: Mapping[str, str], settings: Mapping[str, object]) -> FrictionPlan:
    """Return the plan of a recorded run.

    Args:
        texts: Of its log, by name.
        settings: Other values for fields of `FrictionConfig`.

    Raises:
        InvalidValueError: Something in the texts is wrong, or what is changed cannot be.
    """
    recorded = read_friction_config(texts[FRICTION_TEXT])
    config = changed_config(recorded, settings, RUBBING)
    return plan(config, robot_of(config, settings, texts))
