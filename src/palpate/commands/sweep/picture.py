"""The picture of a sweep: figures against what was varied, over the seeds with their spread."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing
from matplotlib.figure import FigureBase
from matplotlib.ticker import MaxNLocator

from palpate.atomic_file import replacing
from palpate.commands.scale import Scale, scale_of
from palpate.commands.sweep.result import HIGH, LOW, FigureSpread, SweepResult, numbers_of, spread_of
from palpate.commands.typed_values import Varied, shown_value
from palpate.experiments.kit.figure import Figure, is_share
from palpate.reporting.style import (
    FONT_SIZE,
    HEIGHT_COLOURS,
    INK,
    MAP_GROUND,
    MEASURED,
    QUIET,
    SIDE_BY_SIDE,
    SMALL_SIZE,
    Picture,
    Width,
    label,
    legend_above,
    new_figure,
    style_axes,
)

LOGARITHMIC = 20.0
"""Ratio of the largest to the least value from which an option has a logarithmic axis,"""

LOGARITHMIC_FIGURE = 100.0
"""and a figure."""

LEAST_SPAN = 0.01
"""Of an axis of figures, per its largest number."""

LONGEST_NAME = 18
"""Letters of a value below an axis."""

MOST_TICKS = 7
"""Of an axis whose values are fields."""

PANEL_HEIGHT = 3.1
"""[inch]"""

COLUMNS = 3
"""Panels side by side, across a screen."""

LEGEND_COLUMNS = 3
"""Names of lines beside each other: so many fit on a phone."""


@dataclass(frozen=True, slots=True)
class _Panel:
    """What a panel shows: along x one option, or the seeds; for each value of another one a line."""

    along: Varied | None = None
    lines: Varied | None = None

    @property
    def is_map(self) -> bool:
        """Whether it is drawn as fields, for there are too many lines."""
        return self.lines is not None and len(self.lines.values) > len(SIDE_BY_SIDE)


def summary_picture(result: SweepResult) -> Drawing:
    """Return the figures that are shown below one another, for a file."""
    panels = _panels(result)
    across = min(COLUMNS, len(panels))
    rows = -(-len(panels) // across)
    drawing = new_figure(
        Width.FULL if across > 1 else Width.HALF, PANEL_HEIGHT * rows * max(1, len(result.figures))
    )
    parts = drawing.subfigures(max(1, len(result.figures)), 1, squeeze=False)[:, 0]
    drawing.suptitle(result.plan.title, fontsize=FONT_SIZE + 1.0, color=INK)
    for part, figure in zip(parts, result.figures, strict=False):
        _draw(part, rows, across, result, figure, panels)
    if not result.figures:
        drawing.text(0.5, 0.5, "no run has a figure to show", ha="center", fontsize=FONT_SIZE, color=QUIET)
    return drawing


def write_summary(result: SweepResult, path: Path) -> None:
    """Write the picture as a PNG file.

    Raises:
        OSError: The file cannot be written.
    """
    with replacing(path) as file:
        summary_picture(result).savefig(file, format="png", dpi=150)


def pictures(result: SweepResult) -> list[Picture]:
    """Return a picture of each figure, for the report."""
    panels = _panels(result)
    found = []
    for figure in result.figures:
        across = min(COLUMNS, len(panels))
        wide = _alone(result, figure, panels, across)
        narrow = _alone(result, figure, panels, 1) if across > 1 else None
        title = figure.meaning[:1].upper() + figure.meaning[1:]
        found.append(Picture(title=title, caption=_caption(result, figure, panels), full=wide, narrow=narrow))
    return found


def _alone(result: SweepResult, figure: Figure, panels: Sequence[_Panel], across: int) -> Drawing:
    rows = -(-len(panels) // across)
    drawing = new_figure(Width.FULL if across > 1 else Width.HALF, (PANEL_HEIGHT + 0.3) * rows)
    _draw(drawing, rows, across, result, figure, panels)
    return drawing


def _panels(result: SweepResult) -> list[_Panel]:
    """What suits as many options as were really varied."""
    varied = [each for each in result.plan.varied if len(each.values) > 1]
    if not varied:
        return [_Panel()]
    if len(varied) == 1:
        return [_Panel(varied[0])]
    if len(varied) == 2:
        # along x goes what has numbers, and more of them
        along, lines = sorted(varied, key=lambda each: (_numeric(each), len(each.values)), reverse=True)
        return [_Panel(along, lines)]
    return [_Panel(each) for each in varied]


def _caption(result: SweepResult, figure: Figure, panels: Sequence[_Panel]) -> str:
    seeds = len(result.plan.seeds)
    if panels[0].along is None:
        caption = "Each point is a run, one per seed; the line is their median."
    elif is_share(_known(result, figure)):
        caption = "Share of the runs for which it is so."
    elif panels[0].is_map:
        caption = "Medians over the seeds, as colours; grey where no run got to its end."
    elif seeds == 1 and len(panels) == 1:
        caption = "One run each: only more seeds can show what is chance."
    else:
        caption = f"Medians; bands hold the runs from {LOW:g} to {HIGH:g} %"
        caption += f", {seeds} seeds each." if len(panels) == 1 else ", over all seeds and all other options."
        caption += " Where bands do not meet, the difference is hardly chance."
    left = len(result.failures)
    return caption + (
        f" {left} run{'s' if left > 1 else ''} that did not get to the end left out." if left else ""
    )


def _known(result: SweepResult, figure: Figure) -> list[bool | int | float]:
    values = result.values(figure, result.plan.combinations)
    return [value for value in values if isinstance(value, bool | int | float)]


def _draw(
    drawing: FigureBase, rows: int, across: int, result: SweepResult, figure: Figure, panels: Sequence[_Panel]
) -> None:
    values = numbers_of(_known(result, figure))
    scale = scale_of(figure.unit, float(np.abs(values).max()) if values.size else 0.0)
    logarithmic = values.size > 0 and values.min() > 0.0 and values.max() >= LOGARITHMIC_FIGURE * values.min()
    quantity = _quantity(figure.meaning, scale)
    all_axes = list(drawing.subplots(rows, across, squeeze=False).ravel())
    for axes, panel in zip(all_axes, panels, strict=False):
        if panel.along is None:
            _draw_seeds(axes, result, figure, scale, quantity)
        elif panel.is_map:
            _draw_map(axes, result, figure, panel, scale, quantity)
        else:
            _draw_lines(axes, result, figure, panel, scale, quantity)
        if panel.is_map:
            continue
        if logarithmic:
            axes.set_yscale("log")
        else:
            _widen(axes)
    for axes in all_axes[len(panels) :]:
        axes.set_axis_off()
    legend_above(drawing, all_axes, LEGEND_COLUMNS)


def _widen(axes: Axes) -> None:
    """Show no smaller differences than `LEAST_SPAN`: beyond, an axis shows rounding."""
    low, high = axes.get_ylim()
    least = LEAST_SPAN * max(abs(low), abs(high))
    if high - low < least:
        middle = 0.5 * (low + high)
        axes.set_ylim(middle - 0.5 * least, middle + 0.5 * least)


def _draw_seeds(axes: Axes, result: SweepResult, figure: Figure, scale: Scale, quantity: str) -> None:
    pairs = [
        (record.seed, float(value))
        for record in result.records
        if record.done and isinstance(value := record.figures.get(figure.column), bool | int | float)
    ]
    seeds, values = [seed for seed, _ in pairs], [scale.factor * value for _, value in pairs]
    axes.plot(seeds, values, "o", color=MEASURED, markersize=4.0)
    if values:
        axes.axhline(float(np.median(values)), color=QUIET, linewidth=1.0, label="median")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    style_axes(axes, x="seed", y=quantity)


def _draw_lines(
    axes: Axes, result: SweepResult, figure: Figure, panel: _Panel, scale: Scale, quantity: str
) -> None:
    along, lines = panel.along, panel.lines
    assert along is not None
    place, x_label = _placed(axes, result, along)
    groups: Sequence[object] = (None,) if lines is None else lines.values
    shift = 0.0 if _numeric(along) else 0.5 / max(1, len(groups))
    for i, group in enumerate(groups):
        colour = SIDE_BY_SIDE[i % len(SIDE_BY_SIDE)]
        beside = shift * (i - 0.5 * (len(groups) - 1))
        spreads = [_spread(result, figure, along, value, lines, group) for value in along.values]
        known = sorted((x + beside, spread) for x, spread in zip(place, spreads, strict=True) if spread.count)
        if not known:
            continue
        x = [each for each, _ in known]
        middle, low, high = (
            [scale.factor * getattr(spread, name) for _, spread in known] for name in ("middle", "low", "high")
        )
        name = None if lines is None else _line_name(result, lines, group)
        style = "o-" if _numeric(along) else "o"
        axes.plot(x, middle, style, color=colour, linewidth=1.4, markersize=4.0, label=name)
        if _numeric(along) and len(x) > 1:
            axes.fill_between(x, low, high, color=colour, alpha=0.18, linewidth=0.0)
        else:
            axes.vlines(x, low, high, color=colour, alpha=0.5, linewidth=2.0)
    style_axes(axes, x=x_label, y=quantity)


def _draw_map(axes: Axes, result: SweepResult, figure: Figure, panel: _Panel, scale: Scale, quantity: str) -> None:
    along, lines = panel.along, panel.lines
    assert along is not None
    assert lines is not None
    field = np.array(
        [
            [scale.factor * _spread(result, figure, along, x, lines, y).middle for x in along.values]
            for y in lines.values
        ]
    )
    axes.set_facecolor(MAP_GROUND)  # where no run got to its end
    drawn = axes.pcolormesh(np.ma.masked_invalid(field), cmap=HEIGHT_COLOURS)
    style_axes(axes, x=_name(result, along), y=_name(result, lines), grid=False)
    for axis, varied in ((axes.xaxis, along), (axes.yaxis, lines)):
        every = -(-len(varied.values) // MOST_TICKS)
        axis.set_ticks(
            [i + 0.5 for i in range(0, len(varied.values), every)],
            [_value_text(result, varied, value) for value in varied.values[::every]],
        )
    bar = axes.figure.colorbar(drawn, ax=axes)
    bar.set_label(quantity, fontsize=FONT_SIZE, color=INK)
    bar.ax.tick_params(labelsize=SMALL_SIZE, colors=INK)


def _spread(
    result: SweepResult, figure: Figure, along: Varied, value: object, lines: Varied | None, group: object
) -> FigureSpread:
    """Over all runs with that value along x, and of that line."""
    names = [each.name for each in result.plan.varied]
    wanted = {names.index(along.name): value} | ({} if lines is None else {names.index(lines.name): group})
    matching = [
        combination
        for combination in result.plan.combinations
        if all(combination.values[i] == each for i, each in wanted.items())
    ]
    return spread_of(result.values(figure, matching))


def _placed(axes: Axes, result: SweepResult, along: Varied) -> tuple[list[float], str]:
    """Where values stand along x, and what the axis is called."""
    if not _numeric(along):
        names = [_value_text(result, along, value) for value in along.values]
        turned = max(map(len, names)) * len(names) > 32
        axes.set_xticks(range(len(names)), names, rotation=25 if turned else 0, ha="right" if turned else "center")
        axes.set_xlim(-0.6, len(names) - 0.4)
        return [float(i) for i in range(len(names))], _name(result, along)
    numbers = numbers_of([value for value in along.values if isinstance(value, int | float)])
    scale = _option_scale(result, along)
    if numbers.min() > 0.0 and numbers.max() >= LOGARITHMIC * numbers.min():
        axes.set_xscale("log")
    return [scale.factor * value for value in numbers.tolist()], _name(result, along)


def _numeric(varied: Varied) -> bool:
    return all(isinstance(value, int | float) and not isinstance(value, bool) for value in varied.values)


def _option_scale(result: SweepResult, varied: Varied) -> Scale:
    numbers = numbers_of([value for value in varied.values if isinstance(value, int | float)])
    unit = result.plan.unit(varied.name)
    return scale_of(unit, float(np.abs(numbers).max())) if _numeric(varied) else Scale(1.0, unit)


def _value_text(result: SweepResult, varied: Varied, value: object) -> str:
    """A value in the unit of its axis, short enough to stand there."""
    if isinstance(value, float) and _numeric(varied):
        return f"{_option_scale(result, varied).factor * value:.4g}"
    return label(shown_value(value).rsplit("/", 1)[-1], LONGEST_NAME)  # of a file, its name


def _line_name(result: SweepResult, varied: Varied, value: object) -> str:
    """An option with one of its values and their unit."""
    unit = _option_scale(result, varied).unit
    return f"{varied.name.replace('_', ' ')} = {_value_text(result, varied, value)} {unit}".rstrip()


def _name(result: SweepResult, varied: Varied) -> str:
    return _quantity(varied.name.replace("_", " "), _option_scale(result, varied))


def _quantity(words: str, scale: Scale) -> str:
    return f"{words} [{scale.unit}]" if scale.unit else words
