"""What a notebook shows of an exploration is a whole piece of HTML, whatever is missing, and text stays text."""

import dataclasses
from html.parser import HTMLParser

import numpy as np
import pytest
from palpate.experiments.explore.notebook import exploration_html

from mapping.raster import CENTER, RADIUS, sphere_cap
from palpate.reporting.data import ExplorationReport, KeyFigure, TimeSeries
from palpate.runtime import RunTiming

CAP = sphere_cap(half=0.004, step=8e-4)
NONE = np.zeros(0)
PLAIN = ExplorationReport(
    title="A sphere",
    outcome="Done.",
    summary=(KeyFigure("force error", 0.0123456, "N", "of 2 N"),),
    settings=(),
    cloud=CAP,
    series=TimeSeries(NONE, (), NONE, NONE, NONE, NONE),
    timing=RunTiming(NONE, NONE, NONE, 0, "", 1e-3),
)


class Whole(HTMLParser):
    """Whether every tag that is opened is closed in its turn."""

    def __init__(self, html):
        super().__init__()
        self.open, self.tags, self.text = [], [], ""
        self.feed(html)
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        if tag != "img":
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


@pytest.mark.parametrize(
    ("report", "pictures"),
    [
        (PLAIN, 1),
        (dataclasses.replace(PLAIN, point_error=np.linalg.norm(CAP.position - CENTER, axis=1) - RADIUS), 2),
        (dataclasses.replace(PLAIN, cloud=CAP.select(np.zeros(len(CAP), bool))), 0),
    ],
    ids=["no-truth", "truth", "nothing-felt"],
)
def test_there_are_the_figures_and_as_many_pictures_as_can_be(report, pictures):
    whole = Whole(exploration_html(report))
    assert whole.tags.count("img") == pictures
    assert "0.01235" in whole.text
    assert "Done." in whole.text


def test_text_is_text():
    evil = "<script>x</script>"
    figure = KeyFigure(evil, evil, evil, evil)
    whole = Whole(exploration_html(dataclasses.replace(PLAIN, title=evil, outcome=evil, summary=(figure,))))
    assert "script" not in whole.tags
    assert whole.text.count(evil) == 6
