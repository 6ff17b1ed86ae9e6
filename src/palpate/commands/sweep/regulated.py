"""Regulations of force for sweeps: see `palpate.commands.sweep.swept.Carrier`."""

from palpate.commands.sweep.carried import found_in, sinks_of
from palpate.commands.sweep.swept import Found
from palpate.experiments.kit.figure import Figure, FigureValue, number
from palpate.experiments.regulate.config import RegulateConfig
from palpate.experiments.regulate.plan import plan
from palpate.experiments.regulate.run import Attempt, Regulation, prepared, write_regulation

FIGURES = (
    Figure("force_rms_n", "true force, RMS error", "N"),
    Figure("sensed_rms_n", "felt force, RMS error", "N"),
    Figure("landing_max_n", "largest force of landing", "N"),
    Figure("force_max_n", "largest force of the run", "N"),
    Figure("sensor_error_n", "felt less true force at the end", "N"),
    Figure("rise_time_s", "rise time, 10 to 90 %", "s"),
    Figure("overshoot", "overshoot, share of the step"),
    Figure("settling_time_s", "settling time, within 5 %", "s"),
    Figure("bandwidth_hz", "bandwidth, -3 dB", "Hz"),
    Figure("largest_ratio", "largest amplitude ratio"),
    Figure("contact", "what became of the contact"),
    Figure("bounces", "bounces"),
    Figure("gain_halved", "times the gain was halved"),
    Figure("simulated_s", "simulated time", "s"),
)
MERITS = ("rise_time_s", "bandwidth_hz", "overshoot", "force_rms_n", "landing_max_n")
SECONDS = 0.05


def duration_of(config: RegulateConfig) -> float:
    """Plan a run and return about how long it is, simulated [s]."""
    return plan(config).expected_duration


def carry_out(config: RegulateConfig, keep: bool) -> Found:
    """Regulate."""
    planned, identification = prepared(plan(config))
    attempt = Attempt(planned, identification)
    regulation = attempt.found(attempt.run((), sinks_of(planned, keep)))
    if keep:
        write_regulation(regulation, config.out)
    return found_in(regulation.run, figures_of(regulation))


def figures_of(regulation: Regulation) -> dict[str, FigureValue]:
    """Return the figures of a regulation; of the true force, where it is known."""
    force = regulation.judged_force
    steps, tones = regulation.steps(force), regulation.tones(force)
    told: dict[str, FigureValue] = {
        "force_rms_n": number(regulation.true_rms),
        "sensed_rms_n": number(regulation.sensed_rms),
        "landing_max_n": number(regulation.landing_peak),
        "force_max_n": number(regulation.peak),
        "sensor_error_n": number(regulation.sensor_error),
        "contact": regulation.loss.value,
        "bounces": regulation.bounces,
        "gain_halved": regulation.guard_trips,
        "simulated_s": number(regulation.run.duration),
    }
    if steps is not None:
        told |= {
            "rise_time_s": number(steps.rise_time),
            "overshoot": number(steps.overshoot),
            "settling_time_s": number(steps.settling_time),
        }
    if tones is not None:
        told |= {"bandwidth_hz": number(tones.bandwidth), "largest_ratio": number(tones.peak)}
    return told
