"""A regulation of force planned again from its log, as it was or with something changed."""

from collections.abc import Mapping
from dataclasses import replace

from palpate.commands.replay.settings import Changeable, changed_config, robot_of
from palpate.experiments.regulate.config import CHOICES, RegulateConfig
from palpate.experiments.regulate.file import REGULATION_TEXT, read_regulation
from palpate.experiments.regulate.plan import RegulationPlan, plan_from_texts, plan_with

_FELT = "the samples are as recorded, on the surface that was pressed"
_NOISY = "the samples are as recorded, with the noise that they have"
_KEPT = "the log keeps what pressing has found"

FIXED: Mapping[str, str] = {
    "object": _FELT,
    "surface": _FELT,
    "surface_amplitude": _FELT,
    "surface_speed": _FELT,
    "leave_time": _FELT,
    "mount_stiffness": _FELT,
    "mount_damping_ratio": _FELT,
    "mount_mass": _FELT,
    "stiffness": f"{_FELT}; assumed_stiffness is what the gain is made for",
    "friction": _FELT,
    "spin_length": _FELT,
    "force_noise": _NOISY,
    "moment_noise": _NOISY,
    "drift": _NOISY,
    "seed": _NOISY,
    "identify": _KEPT,
    "motion_file": "the log keeps it; another one needs another run",
    "period": "the samples are as recorded, one per period",
    "change": "live parameters are changed as recorded",
    "out": "the regulation writes nothing again; --out says where the report goes",
}
"""Fields of `RegulateConfig` that no replay can change, and why."""

REGULATION = Changeable("a regulation", RegulateConfig, FIXED, CHOICES)


def planned_regulation(texts: Mapping[str, str], settings: Mapping[str, object]) -> RegulationPlan:
    """Return the plan of a recorded regulation.

    Args:
        texts: Of its log, by name.
        settings: Other values for fields of `RegulateConfig`.

    Raises:
        InvalidValueError: Something in the texts is wrong, or what is changed cannot be.
    """
    if not settings:
        planned = plan_from_texts(texts)
        return replace(planned, config=replace(planned.config, change=()))
    recorded = read_regulation(texts[REGULATION_TEXT])
    config = replace(changed_config(recorded, settings, REGULATION), change=())
    return plan_with(config, robot_of(config, settings, texts), texts)
