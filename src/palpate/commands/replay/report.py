"""Findings of a replay as sentences, and its report with figures."""

import shlex
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from palpate.commands.replay.run import ReplayedLog, changeable
from palpate.errors import FloatArray
from palpate.experiments.kit.config_file import VERSIONS_TEXT, versions_text
from palpate.experiments.kit.options import TOUCHED, has_unit, option_words, specs_of
from palpate.plain_text import inert
from palpate.reporting.data import Quantity
from palpate.reporting.figure import TIME, Axis, Figure, Panel
from palpate.reporting.marks import Line, Mark, Points, unnamed
from palpate.reporting.report import NOTHING, Figures, FigureSource, Paragraph, Report, Section
from palpate.reporting.run_figures import phase_spans
from palpate.runtime import Record
from palpate.runtime.palette import COMMAND, FELT
from palpate.runtime.replay_difference import Difference
from palpate.strict_yaml import read_yaml

MILLI = 1e3

SMALLEST_DRAWN = 1e-15
"""[mm/s]. Smaller differences, the last bits of velocities far below 1 mm/s, are drawn as this one."""


def velocity_figure(recorded: Record, replayed: Record) -> Figure:
    """Return the figure of the commanded velocity, axis by axis."""
    rows: list[tuple[Mark, ...]] = [
        (*phase_spans(recorded), *_both(recorded, MILLI * before, MILLI * after))
        for before, after in zip(recorded.command.T[:3], replayed.command.T[:3], strict=True)
    ]
    return Figure(
        title="Commanded velocity",
        caption=(
            "What was commanded when the run was recorded, and what comes out of the same samples now, for each "
            "axis of the base frame; the lines lie on each other where they agree, as they should if nothing was "
            "changed. The ground shows what the recorded controller was doing."
        ),
        panels=(
            Panel(rows[0], TIME, Axis("x", "mm/s"), height=230),
            Panel(unnamed(rows[1]), TIME, Axis("y", "mm/s"), height=180),
            Panel(unnamed(rows[2]), TIME, Axis("z", "mm/s"), height=180),
        ),
        wide=True,
    )


def difference_figure(recorded: Record, replayed: Record) -> Figure | None:
    """Return the figure of how far the commands are apart, or None if they are not."""
    apart = MILLI * np.linalg.norm(replayed.command - recorded.command, axis=1)
    if not np.nansum(apart) > 0.0:
        return None
    shown = np.where(apart > 0.0, np.maximum(apart, SMALLEST_DRAWN), np.nan)
    known = np.isfinite(shown)
    alone = known & ~np.append(known[1:], False) & ~np.append(False, known[:-1])  # no line goes through it
    return Figure(
        title="How far the commands are apart",
        caption=(
            "Length of the difference between replayed and recorded velocity in every period, on a logarithmic "
            f"scale; periods without any are left open. The largest is {np.nanmax(apart):.3g} mm/s. "
            "Nothing at all is good where nothing was changed."
        ),
        panels=(
            Panel(
                (
                    *phase_spans(recorded),
                    Line(recorded.time, shown),
                    Points(recorded.time[alone], shown[alone], size=3.0),
                ),
                TIME,
                Axis("difference", "mm/s", logarithmic=True),
            ),
        ),
        wide=True,
    )


def felt_figure(recorded: Record, replayed: Record) -> Figure | None:
    """Return the figure of the felt normal force, or None if nothing was touched."""
    if not any(side.touching.any() for side in (recorded, replayed)):
        return None
    forces = (np.where(side.touching, side.normal_force, np.nan) for side in (recorded, replayed))
    return Figure(
        title="Felt normal force",
        caption=(
            "The normal force that touch found in the same samples, then and now. It differs only if what sensing "
            "goes by was changed: fingertip, sensor, or set force and stiffness (how far the tip yields)."
        ),
        panels=(
            Panel(
                (*phase_spans(recorded), *_both(recorded, *forces)),
                TIME,
                Axis("normal force", "N"),
            ),
        ),
        wide=True,
    )


def _both(of: Record, recorded: FloatArray, replayed: FloatArray) -> tuple[Line, Line]:
    """A wide pale line below a thin one: where they agree, both are seen."""
    return (
        Line(of.time, recorded, "recorded", COMMAND, width=4.5, opacity=0.5),
        Line(of.time, replayed, "replayed", FELT, width=1.3),
    )


_MILLI = 1e3

REPLAY_FOOTER = (
    "Velocities in the robot's base frame. The samples are as recorded: this is what would have been commanded at "
    "every instant of that run, not what would have happened then."
)


def grouped(count: int) -> str:
    """Return a count with a space after each thousand."""
    return f"{count:,}".replace(",", " ")


def verdict(done: ReplayedLog) -> str:
    """Return in one sentence how many commands came out as recorded."""
    commands, sensing = done.commands, done.sensing
    found = f"{grouped(commands.identical)} of {grouped(commands.count)} commands identical, bit for bit"
    if sensing.first is None:
        return f"{found}; all that was felt is the same"
    return (
        f"{found}; what was felt is the same in {grouped(sensing.identical)} of {grouped(sensing.count)} periods"
    )


def remarks(done: ReplayedLog) -> tuple[str, ...]:
    """Return further remarks, one sentence each."""
    sentences = [done.extent.missing] if done.extent.missing else []
    if done.left_out:
        names = ", ".join(dict.fromkeys(change.name for change in done.left_out))
        sentences.append(
            f"the controller has no live parameter {names}: {len(done.left_out)} recorded changes were left out"
        )
    return tuple(sentences)


def first_differences(done: ReplayedLog) -> tuple[str, ...]:
    """Return where sensing and commands part, if they do."""
    parts = (("sensing", done.sensing), ("commands", done.commands))
    return tuple(f"{name} first at {one.first}" for name, one in parts if one.first is not None)


def version_differences(done: ReplayedLog) -> tuple[str, ...]:
    """Return which versions are others than those that the run was made with."""
    if VERSIONS_TEXT not in done.log.attachments:
        return (f"unknown then: the log has no {VERSIONS_TEXT}",)
    then, now = read_yaml(done.log.attachments[VERSIONS_TEXT]), read_yaml(versions_text())
    if not isinstance(then, dict) or not isinstance(now, dict):
        return (f"unknown then: {VERSIONS_TEXT} in the log makes no sense",)
    names = [name for name in {**then, **now} if then.get(name) != now.get(name)]
    return tuple(f"{name} {then.get(name, 'unknown')} then, {now.get(name, 'unknown')} now" for name in names)


def ending_recorded(done: ReplayedLog) -> str:
    """Return how the recorded run ended."""
    endings = [event.text for event in done.log.events if event.source == "supervisor"]
    endings += [event.text.removeprefix("ended: ") for event in done.log.events if event.source == "run"]
    return inert(endings[0]) if endings else "not recorded: the log breaks off"


def ending_replayed(done: ReplayedLog) -> str:
    """Return how the replay ended."""
    if done.replay.reached_end:
        return "with the last sample"
    trip = done.replay.trip
    return done.replay.result.ending.value if trip is None else str(trip)


def replay_report(done: ReplayedLog, controller: str | None = None) -> Report:
    """Return the report on a replay; `controller` names the one that was in the place of the recorded one."""
    recorded, replayed = done.records()
    any_periods, differs = len(recorded) > 0, bool(np.nansum(np.abs(replayed.command - recorded.command)) > 0.0)
    touched = bool(recorded.touching.any() or replayed.touching.any())

    def commands() -> tuple[FigureSource, ...]:
        drawn = (partial(velocity_figure, recorded, replayed), partial(difference_figure, recorded, replayed))
        return drawn if any_periods else ()

    def felt() -> tuple[Figure | None, ...]:
        return (felt_figure(recorded, replayed),) if any_periods else ()

    same = "" if differs or not any_periods else "No commanded velocity differs."
    nothing = "" if touched or not any_periods else "Nothing was touched."
    return Report(
        title=f"Replay of {done.log.path.resolve().name}",
        outcome=_outcome(done),
        metrics=quantities(done),
        sections=(
            Section("Commands", (Figures(commands), Paragraph(same))),
            Section("Sensing", (Figures(felt), Paragraph(nothing))),
        ),
        asked=_request(done, controller),
        advice=_advice(done),
        settings=_settings(done, controller),
        repeat=_repeat(done, controller),
        footer=REPLAY_FOOTER,
    )


def _advice(done: ReplayedLog) -> tuple[str, ...]:
    if not done.should_be_identical:
        return ("To see what the change does to a run, do the run again with it: samples here stay as they were.",)
    if done.identical:
        return (f"{NOTHING} Sensing and control do what they did.",)
    return (
        "It should have been identical: look at the first difference above, and whether another version of "
        "palpate, numpy or MuJoCo recorded it (palpate log info).",
    )


def _request(done: ReplayedLog, controller: str | None) -> str:
    changed = [f"{name} {_value(done, name)}" for name in done.settings]
    changed += [f"controller {controller}"] if controller else []
    but = f" but for {', '.join(changed)}" if changed else ""
    return f"to sense and command again what {done.log.path.name} recorded, all as it was{but}"


def _repeat(done: ReplayedLog, controller: str | None) -> tuple[tuple[str, str], ...]:
    words = ["palpate", "replay", str(done.log.path)]
    if done.settings:
        words += ["--set", *(f"{name}={_set_value(value)}" for name, value in done.settings.items())]
    if controller:
        words += ["--controller", controller]
    return (("The same again:", shlex.join(words)),)


def _set_value(value: object) -> str:
    each = value if isinstance(value, Sequence) and not isinstance(value, str) else (value,)
    return ",".join(str(one) for one in each)


def quantities(done: ReplayedLog) -> tuple[Quantity, ...]:
    """Return the metrics that matter, most important first."""
    recorded, replayed = done.records()
    apart = np.linalg.norm(replayed.command - recorded.command, axis=1)
    count = grouped(done.commands.count)
    metrics = [Quantity("commands identical", grouped(done.commands.identical), "", f"of {count}, bit for bit")]
    if len(apart):
        largest = int(np.nanargmax(apart)) if np.isfinite(apart).any() else 0
        where = f"at t = {recorded.time[largest]:.3f} s, {recorded.phase[largest]}" if apart[largest] else ""
        metrics += [
            Quantity("commanded velocity apart, RMS", _MILLI * _rms(apart), "mm/s"),
            Quantity("commanded velocity apart, largest", _MILLI * float(apart[largest]), "mm/s", where),
        ]
    metrics += _grip_metrics(done, recorded)
    metrics.append(_first("first difference of a command", done.commands))
    others = np.flatnonzero(recorded.phase != replayed.phase)
    note = "" if not len(others) else f"first {replayed.phase[others[0]]} for {recorded.phase[others[0]]}"
    if len(others):
        note += f" at t = {recorded.time[others[0]]:.3f} s"
    metrics.append(Quantity("periods in another phase", grouped(len(others)), "", note))
    metrics += _sensing_metrics(done, recorded, replayed)
    metrics += [
        Quantity("end of the recorded run", "", "", ending_recorded(done)),
        Quantity("end of the replay", "", "", ending_replayed(done)),
    ]
    return tuple(metrics)


def _grip_metrics(done: ReplayedLog, recorded: Record) -> list[Quantity]:
    """How far the commanded grip is off, where a finger of a hand was commanded in both."""
    sides = ((done.log.codec, done.log.rows), (done.replay.codec, done.replay.rows))
    before, after = (rows[: done.common, codec.columns["command.grip_force"]] for codec, rows in sides)
    both = np.isfinite(before) & np.isfinite(after)
    if not both.any():
        return []
    apart = np.where(both, np.abs(after - before), 0.0)
    largest = int(apart.max(axis=1).argmax())
    where = f"at t = {recorded.time[largest]:.3f} s, {recorded.phase[largest]}" if apart.any() else ""
    return [
        Quantity("commanded grip apart, RMS", _rms(apart[both]), "N", "of every finger"),
        Quantity("commanded grip apart, largest", float(apart.max()), "N", where),
    ]


def _sensing_metrics(done: ReplayedLog, recorded: Record, replayed: Record) -> list[Quantity]:
    sensing, count = done.sensing, grouped(done.sensing.count)
    metrics = [Quantity("periods felt alike", grouped(sensing.identical), "", f"of {count}, bit for bit")]
    if sensing.first is None:
        return metrics
    both = recorded.touching & replayed.touching
    apart = np.abs(replayed.normal_force - recorded.normal_force)[both]
    if len(apart):
        largest = f"largest {apart.max():.3g}"
        metrics.append(Quantity("felt normal force apart, RMS", _rms(apart), "N", largest))
    return [*metrics, _first("first difference of sensing", sensing)]


def _first(name: str, difference: Difference) -> Quantity:
    first = difference.first
    if first is None:
        return Quantity(name, "none")
    return Quantity(name, f"{first.time:.3f}", "s", first.name.removeprefix("command.") or "the replay had ended")


def _rms(values: np.ndarray[tuple[int], np.dtype[np.float64]]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _outcome(done: ReplayedLog) -> str:
    differences = first_differences(done) if done.should_be_identical else ()  # otherwise the table shows it
    sentences = [verdict(done), *(f"differs: {sentence}" for sentence in differences), *remarks(done)]
    return " ".join(f"{sentence[0].upper()}{sentence[1:]}." for sentence in sentences)


def _settings(done: ReplayedLog, controller: str | None) -> tuple[tuple[str, str], ...]:
    """Return the settings: changed options first, then the other options that a replay can change."""
    changed = [(name, _value(done, name) + " (changed)") for name in done.settings]
    others = [
        (name, _value(done, name)) for name in changeable(type(done.planned.config)) if name not in done.settings
    ]
    return (
        *changed,
        ("controller", f"{controller} (changed)" if controller else "as recorded"),
        *others,
        ("recorded by", f"palpate {done.of.experiment.name}"),
        *((name, _value(done, name)) for name in _touched(done)),
        *(
            ("changed while it ran", f"{change.name} to {change.value:g} at t = {change.time:.3f} s")
            for change in done.log.changes
            if change not in done.left_out
        ),
        ("log", str(_absolute(done.log.path))),
    )


def _value(done: ReplayedLog, name: str) -> str:
    value = getattr(done.planned.config, name)
    unit = specs_of(type(done.planned.config))[name].unit if has_unit(value) else ""
    return f"{option_words(value)} {unit}".rstrip()


def _absolute(path: Path) -> Path:
    return path.resolve()


def _touched(done: ReplayedLog) -> tuple[str, ...]:
    """Return the options that describe the touched object."""
    return tuple(name for name, spec in specs_of(type(done.planned.config)).items() if spec.fixed == TOUCHED)
