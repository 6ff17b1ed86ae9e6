"""The configuration of a run that finds out about friction, as text for its log."""

from palpate.experiments.friction.config import FrictionConfig
from palpate.experiments.kit.experiment_file import plain_values
from palpate.strict_decode import decode, read_mapping
from palpate.yaml_text import yaml_text

FRICTION_TEXT = "friction_run.yaml"
"""Under this name a log keeps the configuration."""


def friction_text(config: FrictionConfig) -> str:
    """Return a configuration as YAML, every value written out; `read_friction_config` gives back the very same."""
    return yaml_text(plain_values(config))


def read_friction_config(text: str) -> FrictionConfig:
    """Return the configuration that `friction_text` wrote.

    Raises:
        InvalidValueError: A key is misspelt, a value of the wrong type, or they cannot be together.
    """
    return decode(read_mapping(text, "a run that finds out about friction"), FrictionConfig, text)
