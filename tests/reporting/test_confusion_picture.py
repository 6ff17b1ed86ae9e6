"""The picture of a confusion matrix: its figures, and names of any kind."""

import numpy as np
import pytest

from palpate.experiments.friction.confusion_picture import LONGEST_NAME, MOST_FIGURES, confusion_picture
from palpate.friction.materials.trials import UNKNOWN, Confusion


def written(figure):
    figure.draw_without_rendering()
    axes = figure.axes[0]
    return {(text.get_position()[1] - 0.5, text.get_position()[0] - 0.5): text.get_text() for text in axes.texts}


def test_every_share_is_written_in_its_cell_and_rare_ones_are_not_rounded_away():
    counts = np.array([[998, 1, 1], [0, 500, 500], [0, 0, 0], [0, 0, 7]])
    picture = confusion_picture(Confusion(("a", "b", "c", "brick"), ("a", "b", UNKNOWN), counts))
    for figure in (picture.full, picture.narrow):
        assert written(figure) == {
            (0, 0): ">99", (0, 1): "<1", (0, 2): "<1", (1, 1): "50", (1, 2): "50", (3, 2): "100",
        }  # fmt: skip
        axes = figure.axes[0]
        assert [label.get_text() for label in axes.get_yticklabels()] == ["a", "b", "c", "brick"]
        assert axes.yaxis_inverted()


@pytest.mark.parametrize("count", [1, MOST_FIGURES + 5])
def test_long_names_dollars_and_many_rows_are_drawn(count):
    names = tuple(f"{i} costs 3$ and is ${'very ' * 9}long" for i in range(count))
    counts = np.eye(count, count + 1, dtype=np.int64)
    picture = confusion_picture(Confusion(names, (*names, UNKNOWN), counts))
    assert len(written(picture.narrow)) == (count if count < MOST_FIGURES else 0)
    label = picture.narrow.axes[0].get_yticklabels()[0].get_text()
    assert len(label.replace("\\", "")) == LONGEST_NAME
