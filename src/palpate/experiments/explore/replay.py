"""An exploration planned again from its log, as it was or with something changed."""

from collections.abc import Mapping
from dataclasses import replace

from palpate.commands.replay.settings import Changeable, changed_config, robot_of
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.plan import ExplorationPlan, plan_with
from palpate.experiments.kit.experiment_file import EXPERIMENT_TEXT, read_config

_FELT = "the samples are as recorded, on the object that was touched"
_NOISY = "the samples are as recorded, with the noise that they have"

FIXED: Mapping[str, str] = {
    "object": _FELT,
    "size": _FELT,
    "file": _FELT,
    "scale": _FELT,
    "friction": _FELT,
    "spin_length": _FELT,
    "force_noise": _NOISY,
    "moment_noise": _NOISY,
    "seed": _NOISY,
    "identify": "the log keeps what pressing has found",
    "period": "the samples are as recorded, one per period",
    "change": "live parameters are changed as recorded",
    "out": "the exploration writes nothing again; --out says where the report goes",
}
"""Fields of `ExploreConfig` that no replay can change, and why."""

EXPLORATION = Changeable("an exploration", ExploreConfig, FIXED)


def planned_exploration(texts: Mapping[str, str], settings: Mapping[str, object]) -> ExplorationPlan:
    """Return the plan of a recorded exploration.

    Args:
        texts: Of its log, by name.
        settings: Other values for fields of `ExploreConfig`.

    Raises:
        InvalidValueError: Something in the texts is wrong, or what is changed cannot be.
    """
    recorded = read_config(texts[EXPERIMENT_TEXT])
    config = replace(changed_config(recorded, settings, EXPLORATION), change=())  # what was changed, the log says
    return plan_with(config, robot_of(config, settings, texts), texts)
