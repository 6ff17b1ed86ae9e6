"""Pictures of runs side by side: figures in which they differ, and how far their maps are apart."""

import math
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from mapping.raster import sphere_cap
from palpate.commands.compare.compared_figure import ComparedFigure
from palpate.commands.compare.difference_picture import MapDifference, difference_picture
from palpate.commands.compare.run_pictures import bars_picture, spread_picture
from palpate.experiments.kit.comparable import ErrorSample
from palpate.mapping import MapSettings, SurfaceMap, surface_mesh
from palpate.reporting.marks import Bars, Line
from palpate.reporting.plots import plots
from support.drawn import panels

NAMES = ("a", "b", "c")


def test_bars_show_what_differs_in_one_unit():
    figures = [
        ComparedFigure("error", "m", (2e-6, 3e-6, math.nan)),
        ComparedFigure("alike", "N", (1.0, 1.01, 1.0)),
        ComparedFigure("ending", "", ("done", "lost", "done")),
    ]
    (panel,) = panels(bars_picture(figures, NAMES))
    assert panel.x.label == "error [µm]"
    assert [(bars.at[0], bars.length[0]) for bars in panel.marks if isinstance(bars, Bars)] == [
        (2.0, 2.0),
        (1.0, 3.0),
    ]
    assert dict(panel.y.ticks) == {2.0: "a", 1.0: "b", 0.0: "c"}
    assert bars_picture(figures[1:], NAMES) is None


def test_shares_of_errors_are_of_each_runs_own_points():
    samples = [ErrorSample("t", "c", "error", "µm", np.linspace(-1.0, 1.0, count)) for count in (100, 10_000)]
    (panel,) = panels(spread_picture([*samples, None], NAMES))
    lines = [mark for mark in panel.marks if isinstance(mark, Line)]
    assert [line.name for line in lines] == ["a", "b"]
    assert [line.y[1:-1:2].sum() for line in lines] == pytest.approx([100.0, 100.0])


@cache
def felt(up=0.0, aside=0.0):
    """The map of a cap, somewhere else."""
    cloud = sphere_cap(half=0.004, step=4e-4)
    moved = SurfaceMap.learned(
        replace(cloud, position=cloud.position + np.array([aside, 0.0, up])), MapSettings.for_rows(2e-3, bias=1e-6)
    )
    return SimpleNamespace(surface=moved, mesh=surface_mesh(moved, 1e-3))


def test_a_map_that_lies_further_out_by_so_much_is_shown_so():
    found = MapDifference.of(felt(), felt(up=50e-6))
    assert len(found.common) > 0.9 * len(found.height)
    assert found.common == pytest.approx(50e-6 * felt().mesh.normals[np.isfinite(found.height), 2], abs=1e-6)
    picture = difference_picture([felt(), None, felt(up=50e-6)], NAMES)
    assert "c: 49" in picture.caption
    assert "0 % within both bands" in picture.caption
    assert [space.title for space in picture.panels] == ["c less a"]
    assert plots(picture)
