"""The report on a replay: whole, well formed, and its pictures show what differs."""

import dataclasses
import re

import numpy as np
import pytest
from matplotlib.colors import to_hex
from palpate.commands.replay.report_data import ReplayReport, ReplaySeries
from palpate.commands.replay.report_page import replay_html, write_replay_report

from palpate.commands.replay.pictures import (
    RECORDED,
    REPLAYED,
    difference_picture,
    felt_picture,
    velocity_picture,
)
from palpate.errors import InvalidValueError
from palpate.reporting.data import KeyFigure
from reporting.test_report import parsed

COUNT = 4000
TIME = np.arange(COUNT) * 1e-3
PHASES = ["approach"] * 1000 + ["scan"] * 2900 + ["lift"] * 100
APART_FROM = 1500


def side(scale=1.0, force=2.0, count=COUNT):
    velocity = np.stack([0.02 * np.sin(TIME), 0.01 * np.cos(TIME), np.full(COUNT, -0.005)], axis=1)
    velocity[APART_FROM:] *= scale
    felt = np.full(COUNT, force)
    felt[:1000] = np.nan
    return ReplaySeries(TIME[:count], PHASES[:count], velocity[:count], felt[:count])


def report_of(recorded, replayed):
    return ReplayReport(
        title="Replay of <a log>",
        outcome="1 500 of 4 000 commands identical, bit for bit.",
        summary=(KeyFigure("commands identical", "1 500", "", "of 4 000"), KeyFigure("RMS", 1.5, "mm/s")),
        settings=(("force", "3 N (changed)"),),
        recorded=recorded,
        replayed=replayed,
    )


OTHER = report_of(side(), side(1.1, 2.01))
SAME = report_of(side(), side())
NOTHING = report_of(side(count=0), side(count=0))


def lines(axes):
    return {to_hex(line.get_color()): line for line in axes.lines}


@pytest.mark.slow
def test_the_whole_report_is_well_formed_and_needs_nothing_else():
    checker = parsed(replay_html(OTHER))
    assert checker.tags.count("img") == checker.tags.count("figcaption") == 3
    assert all(link.startswith("data:") for link in checker.links)
    text = " ".join(checker.text)
    for said in ("Replay of <a log>", "1 500", "mm/s", "3 N (changed)", "not what would have happened"):
        assert said in text


@pytest.mark.slow
def test_without_a_difference_there_is_a_sentence_instead_of_the_picture():
    html = replay_html(SAME)
    assert parsed(html).tags.count("img") == 2
    assert "No commanded velocity differs" in html


def test_without_a_period_there_is_a_report_all_the_same():
    assert parsed(replay_html(NOTHING)).tags.count("img") == 0


def test_without_contact_there_is_no_picture_of_it():
    untouched = dataclasses.replace(side(), normal_force=np.full(COUNT, np.nan))
    assert felt_picture(report_of(untouched, untouched)) is None
    assert felt_picture(report_of(untouched, side())) is not None


@pytest.mark.slow
def test_the_same_report_gives_the_same_file_in_place_of_the_former(tmp_path):
    path = tmp_path / "r.html"
    path.write_text("former")
    write_replay_report(SAME, path)
    first = path.read_bytes()
    write_replay_report(SAME, path)
    assert path.read_bytes() == first
    assert [file.name for file in tmp_path.iterdir()] == ["r.html"]


def test_each_axis_has_both_lines_the_replayed_one_thin_and_on_top():
    picture = velocity_picture(OTHER)
    for figure in (picture.full, picture.narrow):
        assert [axes.get_ylabel() for axes in figure.axes] == ["x [mm/s]", "y [mm/s]", "z [mm/s]"]
        assert figure.axes[-1].get_xlabel() == "time [s]"
        for i, axes in enumerate(figure.axes):
            recorded, replayed = lines(axes)[RECORDED], lines(axes)[REPLAYED]
            assert axes.lines.index(replayed) > axes.lines.index(recorded)
            assert recorded.get_linewidth() > 2.0 * replayed.get_linewidth()
            # no peak is lost
            for line, own in ((recorded, OTHER.recorded), (replayed, OTHER.replayed)):
                drawn = np.asarray(line.get_ydata())
                assert np.max(drawn) == pytest.approx(1e3 * own.velocity[:, i].max())
                assert np.min(drawn) == pytest.approx(1e3 * own.velocity[:, i].min())


def test_the_difference_is_drawn_on_a_logarithmic_scale_from_where_there_is_one():
    picture = difference_picture(OTHER)
    (axes,) = picture.full.axes
    assert axes.get_yscale() == "log"
    assert axes.get_xlim()[0] == TIME[0]
    (line,) = axes.lines
    time, drawn = np.asarray(line.get_xdata()), np.asarray(line.get_ydata())
    assert np.isnan(drawn[time < TIME[APART_FROM]]).all()
    assert np.isfinite(drawn[time >= TIME[APART_FROM]]).all()
    apart = 1e3 * 0.1 * np.linalg.norm(side().velocity[APART_FROM:], axis=1)
    assert np.nanmax(drawn) == pytest.approx(apart.max())
    assert re.search(r"largest is [\d.]+ mm/s", picture.caption)


def test_a_difference_of_one_period_is_seen():
    replayed = side()
    replayed.velocity[2000, 0] += 1e-9
    (axes,) = difference_picture(report_of(side(), replayed)).full.axes
    (line,) = axes.lines
    assert np.isfinite(np.asarray(line.get_ydata())).sum() == 1
    assert line.get_marker() == "."  # a line through one point would not show


@pytest.mark.parametrize("field", ["phase", "velocity", "normal_force"])
def test_sides_of_another_length_are_refused(field):
    with pytest.raises(InvalidValueError, match=f"{field} has shape"):
        dataclasses.replace(side(), **{field: getattr(side(), field)[1:]})


def test_sides_of_other_samples_are_refused():
    later = dataclasses.replace(side(), time=TIME + 1.0)
    with pytest.raises(InvalidValueError, match="different times"):
        report_of(side(), later)
