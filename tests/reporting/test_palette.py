"""Colours: legible on either ground, told apart by colour-blind eyes, defined in one place."""

import inspect
import itertools
import re
from pathlib import Path

import numpy as np
import pytest

import palpate.reporting as reporting
import palpate.viewing as viewing
from palpate.reporting.marks import ColourScale
from palpate.runtime import palette
from palpate.sim.render.renderer import ARROW_COLOUR as DRAWN
from palpate.viewing.drawing import ARROW_COLOUR as VIEWED
from palpate.viewing.look import linear_rgb

THEMES = ("light", "dark")
TEXT_CONTRAST, DRAWN_CONTRAST = 4.5, 3.0  # WCAG 2.2, success criteria 1.4.3 and 1.4.11, level AA

# Machado, Oliveira, Fernandes (2009), severity 1: of linear RGB
BLIND = {
    "protan": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deutan": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritan": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
    "none": np.eye(3).tolist(),
}
APART = 10.0  # CIE 1976 colour difference: about four times what is just told apart side by side


def linear(colour):
    c = np.array([int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)])
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def contrast(one, other):
    bright = sorted(float(np.array([0.2126, 0.7152, 0.0722]) @ linear(each)) for each in (one, other))
    return (bright[1] + 0.05) / (bright[0] + 0.05)


def lab(rgb):
    matrix = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    xyz = matrix @ np.clip(rgb, 0.0, 1.0) / np.array([0.9505, 1.0, 1.089])
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16.0 / 116.0)
    return np.array([116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])])


def test_contrast_is_that_of_black_on_white():
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)
    assert contrast("#767676", "#ffffff") == pytest.approx(4.54, abs=0.01)


OVER_TIME = (palette.FELT, palette.TRUTH, palette.SET, palette.BOUND, palette.INK_COLOUR, palette.QUIET_COLOUR)
GROUNDS = (*palette.GROUNDS, palette.GROUND)


@pytest.mark.parametrize("theme", THEMES)
@pytest.mark.parametrize(
    ("colours", "grounds", "least"),
    [
        (palette.TEXT, GROUNDS, TEXT_CONTRAST),
        (palette.DRAWN, GROUNDS, DRAWN_CONTRAST),
        (OVER_TIME, set(palette.STAGES) - {palette.LOST}, DRAWN_CONTRAST),
    ],
    ids=["text", "drawn", "over time"],
)
def test_text_and_lines_can_be_read_on_every_ground_and_phase(colours, grounds, least, theme):
    for colour, ground in itertools.product(colours, grounds):
        assert contrast(getattr(colour, theme), getattr(ground, theme)) >= least, (colour.name, ground.name)


TOGETHER = (
    (palette.FELT, palette.TRUTH, palette.SET, palette.BOUND),
    (palette.FELT, palette.COMMAND),
    (palette.FELT, palette.TRUTH, palette.SPIN_COLOUR, palette.SET),
    palette.SIDE_BY_SIDE[:3],
)
"""Colours in one picture: of forces, of a replay, of a grasp, of runs side by side."""


@pytest.mark.parametrize("theme", THEMES)
@pytest.mark.parametrize("eyes", list(BLIND))
def test_all_eyes_can_distinguish_the_colours_of_one_picture(theme, eyes):
    for colours in TOGETHER:
        seen = {each.name: lab(np.array(BLIND[eyes]) @ linear(getattr(each, theme))) for each in colours}
        for one, other in itertools.combinations(seen, 2):
            assert np.linalg.norm(seen[one] - seen[other]) >= APART, (one, other)


def test_every_colour_is_one_thing():
    assert len({each.light for each in palette.ALL}) == len(palette.ALL)
    assert len({each.name for each in palette.ALL}) == len(palette.ALL)
    assert all(re.fullmatch("#[0-9a-f]{6}", c) for each in palette.ALL for c in (each.light, each.dark))


@pytest.mark.parametrize("package", [reporting, viewing], ids=["reporting", "viewing"])
def test_no_colour_is_defined_elsewhere(package):
    for path in Path(package.__file__).parent.glob("*.py"):
        # scales go from numbers to colours, on either ground
        source = path.read_text().replace(inspect.getsource(ColourScale), "")
        found = re.findall(r"#[0-9a-fA-F]{6}\b|\"(?:white|black|red|green|blue|gr[ae]y)\"", source)
        assert not found, (path.name, found)


def test_a_force_that_is_felt_has_one_colour_in_reports_in_the_view_and_in_pictures():
    assert linear_rgb(palette.FELT) == VIEWED
    assert [round(255.0 * part) for part in DRAWN[:3]] == list(palette.rgb(palette.FELT))
