"""Interface of an experiment, and the parts that experiments share.

This module imports nothing heavy, for modules that `--help` imports; modules below run, record and draw.
"""

from palpate.experiments.kit.experiment import (
    DryRun,
    Experiment,
    ExperimentDefaults,
    Plan,
    PlanDefaults,
    Result,
    Writer,
)
from palpate.experiments.kit.metric import Finding, Metric, MetricValue, metrics_of
from palpate.experiments.kit.options import CHANGED, NOISY, PERIODIC, TOUCHED, WRITTEN, check_options, option

__all__ = [
    "CHANGED",
    "NOISY",
    "PERIODIC",
    "TOUCHED",
    "WRITTEN",
    "DryRun",
    "Experiment",
    "ExperimentDefaults",
    "Finding",
    "Metric",
    "MetricValue",
    "Plan",
    "PlanDefaults",
    "Result",
    "Writer",
    "check_options",
    "metrics_of",
    "option",
]
