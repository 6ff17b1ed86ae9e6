"""What a notebook shows of a report is a whole piece of HTML, whatever is missing, and text stays text."""

from html.parser import HTMLParser

import matplotlib.pyplot as plt
import pytest

from palpate.reporting.data import KeyFigure
from palpate.reporting.notebook import report_fragment
from palpate.reporting.report import Paragraph, Pictures, Report, Section
from palpate.reporting.style import Picture

FIGURE = KeyFigure("force error", 0.0123456, "N", "of 2 N")


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


def picture(title):
    return Picture(title, "A caption.", plt.figure())


@pytest.mark.parametrize(
    ("drawn", "shown"),
    [((), []), (([None],), []), ((["a", "b"], ["c"]), ["a", "b"]), (([None], [None, "c"]), ["c"])],
    ids=["no-pictures", "none", "the-first", "the-first-there-are"],
)
def test_there_are_the_figures_and_the_first_pictures(drawn, shown):
    sections = tuple(
        Section("s", (Paragraph("p"), Pictures(lambda titles=titles: (t and picture(t) for t in titles))))
        for titles in drawn
    )
    html = report_fragment(Report("A sphere", "Done.", (FIGURE,), sections))
    whole = Whole(html)
    assert whole.tags.count("img") == len(shown)
    assert all(f'alt="{title}"' in html for title in shown)
    assert "0.01235" in whole.text
    assert "Done." in whole.text


def test_text_is_text():
    evil = "<script>x</script>"
    whole = Whole(report_fragment(Report(evil, evil, (KeyFigure(evil, evil, evil, evil),))))
    assert "script" not in whole.tags
    assert whole.text.count(evil) == 6
