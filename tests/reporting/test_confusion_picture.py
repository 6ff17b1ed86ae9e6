"""The picture of a confusion matrix: its figures, and names of any kind."""

import numpy as np
import pytest

from palpate.experiments.friction.confusion_picture import LONGEST_NAME, MOST_FIGURES, confusion_picture
from palpate.friction.materials.trials import UNKNOWN, Confusion
from support.drawn import panels


def cells(confusion):
    (panel,) = panels(confusion_picture(confusion))
    (mark,) = panel.marks
    return mark


def test_every_share_is_written_in_its_cell_and_rare_ones_are_not_rounded_away():
    counts = np.array([[998, 1, 1], [0, 500, 500], [0, 0, 0], [0, 0, 7]])
    shown = cells(Confusion(("a", "b", "c", "brick"), ("a", "b", UNKNOWN), counts))
    assert shown.texts == (">99", "<1", "<1", "", "50", "50", "", "", "", "", "", "100")
    assert (shown.rows, shown.columns) == (("a", "b", "c", "brick"), ("a", "b", UNKNOWN))
    assert np.isfinite(shown.colouring.values).tolist() == [text != "" for text in shown.texts]


@pytest.mark.parametrize("count", [2, MOST_FIGURES + 5])
def test_long_names_stay_apart_and_many_rows_have_no_figures(count):
    names = tuple(f"as {'very ' * 9}long as {i}" for i in range(count))
    shown = cells(Confusion(names, (*names, UNKNOWN), np.eye(count, count + 1, dtype=np.int64)))
    assert bool(shown.texts) == (count < MOST_FIGURES)
    assert len(set(shown.rows)) == count
    assert all(len(name) <= LONGEST_NAME + 4 for name in shown.rows)
