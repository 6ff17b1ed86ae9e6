"""A grasp planned again from its log, as it was or with something changed."""

from collections.abc import Mapping
from dataclasses import replace

from palpate.commands.replay.settings import Changeable, changed_config
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.plan import GraspPlan, plan, plan_from_texts, plan_with
from palpate.experiments.grasp.text import GRASP_TEXT, read_grasp

_FELT = "the samples are as recorded, of the object that was held"
_PULLED = "the samples are as recorded, with what pulled then"
_NOISY = "the samples are as recorded, with the noise that they have"

FIXED: Mapping[str, str] = {
    "object": _FELT,
    "size": _FELT,
    "mass": _FELT,
    "friction": _FELT,
    "spin_length": _FELT,
    "norm_exponent": _FELT,
    "load_exponent": _FELT,
    "plant": _FELT,
    "fingers": "the samples are as recorded, of the fingers that there were",
    "load": _PULLED,
    "pull": _PULLED,
    "pull_before": _PULLED,
    "rise": _PULLED,
    "shake_frequency": _PULLED,
    "offset": _PULLED,
    "force_noise": _NOISY,
    "moment_noise": _NOISY,
    "drift": _NOISY,
    "seed": "the samples are as recorded, with its noise, and what it drew to be believed; set believed_friction",
    "against_ignoring_spin": "the log is of the first of both; set ignore_spin",
    "robot": "the samples are as recorded, of the hand that there was",
    "out": "the grasp writes nothing again; --out says where the report goes",
}
"""Fields of `GraspConfig` that no replay can change, and why."""

GRASPING = Changeable("a grasp", GraspConfig, FIXED)


def planned_grasp(texts: Mapping[str, str], settings: Mapping[str, object]) -> GraspPlan:
    """Return the plan of a recorded grasp.

    Args:
        texts: Of its log, by name.
        settings: Other values for fields of `GraspConfig`.

    Raises:
        InvalidValueError: Something in the texts is wrong, or what is changed cannot be.
    """
    if not settings:
        return plan_from_texts(texts)
    recorded = replace(read_grasp(texts[GRASP_TEXT]), against_ignoring_spin=False)  # the log is of the first
    config = changed_config(recorded, settings, GRASPING)
    # a friction file that is kept is the one the log has the text of: it may be gone, or another by now
    return plan(config) if "friction_file" in settings else plan_with(config, texts)
