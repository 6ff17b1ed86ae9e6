"""What experiments share, and what whoever writes one needs; knows none of them.

The light half is here, for modules that `--help` imports; what runs, records and draws is in the modules below.
"""

from palpate.experiments.kit.experiment import DryRun, Experiment, Plan, PlanDefaults, Result, Writer
from palpate.experiments.kit.experiment_defaults import ExperimentDefaults
from palpate.experiments.kit.metric import Metric, MetricValue, metrics_of
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
