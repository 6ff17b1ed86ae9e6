"""What a notebook shows of a report is a whole piece of HTML, whatever is missing, and text stays text."""

import numpy as np
import pytest

from palpate.reporting.data import KeyFigure
from palpate.reporting.marks import Line
from palpate.reporting.notebook import report_fragment
from palpate.reporting.picture import TIME, Axis, Panel, Picture
from palpate.reporting.report import Paragraph, Pictures, Report, Section
from reporting.test_report import parsed

FIGURE = KeyFigure("force error", 0.0123456, "N", "of 2 N")
NONE = Section("Nothing seen", (Pictures(lambda: [None]),))
PICTURE = Picture(
    "Force", "It rises.", (Panel((Line(np.arange(9.0), np.arange(9.0)),), TIME, Axis("force", "N")),)
)
DRAWN = Section("Errors", (Paragraph("x"), Pictures(lambda: [None, PICTURE, PICTURE])))


@pytest.mark.parametrize(("sections", "pictures"), [((), 0), ((NONE,), 0), ((NONE, DRAWN, DRAWN), 1)])
def test_there_are_the_figures_and_the_first_picture_that_there_is(sections, pictures):
    whole = parsed(report_fragment(Report("A sphere", "Done.", (FIGURE,), sections)))
    assert whole.tags.count("img") == pictures
    assert {"0.01235", "Done."} <= set(whole.text)


def test_text_is_text():
    evil = "<script>x</script>"
    whole = parsed(report_fragment(Report(evil, evil, (KeyFigure(evil, evil, evil, evil),))))
    assert "script" not in whole.tags
    assert whole.text.count(evil) == 6
