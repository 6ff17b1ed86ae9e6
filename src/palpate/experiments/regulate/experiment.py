"""Regulation of a force, as an experiment."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from palpate.experiments.kit.experiment import ExperimentDefaults, Writer
from palpate.experiments.kit.metric import Metric, MetricValue
from palpate.experiments.regulate.config import RegulateConfig

if TYPE_CHECKING:
    from palpate.experiments.kit.recorded_run import Recorded
    from palpate.experiments.regulate.plan import RegulationPlan
    from palpate.experiments.regulate.result import RegulationResult
    from palpate.reporting.report import Report
    from palpate.robots.robot import Robot


def _of_steps(column: str, meaning: str, unit: str, value: Callable[[Any], float]) -> Metric:
    """A metric of the step response; None if there is none."""
    return Metric(column, meaning, unit, lambda found: _known(found.judged_steps, value))


def _of_sines(column: str, meaning: str, unit: str, value: Callable[[Any], float | None]) -> Metric:
    """Likewise of the frequency response."""
    return Metric(column, meaning, unit, lambda found: _known(found.judged_tones, value))


def _known(response: Any, value: Callable[[Any], MetricValue]) -> MetricValue:
    return None if response is None else value(response)


METRICS = (
    _of_steps("rise_time_s", "rise time, 10 to 90 %", "s", lambda steps: steps.rise_time),
    _of_sines("bandwidth_hz", "bandwidth, -3 dB", "Hz", lambda tones: tones.bandwidth),
    _of_steps("overshoot", "overshoot, share of the step", "", lambda steps: steps.overshoot),
    Metric("force_rms_n", "true force, RMS error", "N", lambda found: found.true_rms),
    Metric("landing_max_n", "largest force of landing", "N", lambda found: found.landing_peak),
    Metric("sensed_rms_n", "felt force, RMS error", "N", lambda found: found.sensed_rms),
    Metric("force_max_n", "largest force of the run", "N", lambda found: found.peak),
    Metric("sensor_error_n", "felt less true force at the end", "N", lambda found: found.sensor_error),
    _of_steps("settling_time_s", "settling time, within 5 %", "s", lambda steps: steps.settling_time),
    _of_sines("largest_ratio", "largest amplitude ratio", "", lambda tones: tones.peak),
    Metric("contact", "what became of the contact", "", lambda found: found.loss.value),
    Metric("bounces", "bounces", "", lambda found: found.bounces),
    Metric("gain_halved", "times the gain was halved", "", lambda found: found.guard_trips),
    Metric("simulated_s", "simulated time", "s", lambda found: found.run.duration),
)
"""Those that matter most first."""


class Regulate(ExperimentDefaults):
    """See `palpate.experiments.kit.experiment.Experiment`."""

    name = "regulate"
    summary = "Hold a force on a surface."
    Config = RegulateConfig
    metrics = METRICS

    def plan(
        self, config: RegulateConfig, robot: "Robot | None", attachments: Mapping[str, str]
    ) -> "RegulationPlan":
        """Check and build everything."""
        from palpate.experiments.regulate.plan import plan_regulation

        assert robot is not None  # there always is one: RegulateConfig.robot is never None
        return plan_regulation(config, robot, attachments)

    def evaluate(self, plan: "RegulationPlan", recorded: "Recorded") -> "RegulationResult":
        """Return what came of a run."""
        from palpate.experiments.regulate.result import regulation_in

        return regulation_in(plan, recorded)

    def report(self, result: "RegulationResult") -> "Report":
        """Return the report."""
        from palpate.experiments.regulate.report import regulation_report

        return regulation_report(result)

    def files(self, result: "RegulationResult") -> Mapping[str, Writer]:
        """Return the file of the forces."""
        from palpate.experiments.regulate.plan import FORCES_FILE
        from palpate.experiments.regulate.result import write_forces

        return {FORCES_FILE: partial(write_forces, result)}
