"""The configuration of a grasp, as text for its log."""

from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.kit.experiment_file import plain_values
from palpate.strict_decode import decode, read_mapping
from palpate.yaml_text import yaml_text

GRASP_TEXT = "grasp.yaml"
"""Under this name a log keeps the configuration,"""

KNOWN_TEXT = "friction.yaml"
"""and under this what rubbing had found, if that was planned with."""


def grasp_text(config: GraspConfig) -> str:
    """Return a configuration as YAML, every value written out; `read_grasp` gives back the very same."""
    return yaml_text(plain_values(config))


def read_grasp(text: str) -> GraspConfig:
    """Return the configuration that `grasp_text` wrote.

    Raises:
        InvalidValueError: A key is misspelt, a value of the wrong type, or they cannot be together.
    """
    return decode(read_mapping(text, "a grasp"), GraspConfig, text)
