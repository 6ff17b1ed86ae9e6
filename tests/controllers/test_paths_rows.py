"""Rows of a raster that goes beyond the object: all of it is swept, and little is tried where nothing is."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers import Raster
from palpate.controllers.paths import ContactPeriod, Hop, LegEnd, PathEvent, Stroke
from palpate.controllers.paths.rows import RasterRows
from support.paths_world import HeightWorld, explore

RASTER = Raster(0.05, 0.05, 0.004)

STEP, BALL = 1e-3, 4e-3


def box(x, y, width, depth):
    return lambda u, v: max(abs(u - x) - 0.5 * width, abs(v - y) - 0.5 * depth)


def disc(radius, x=0.0, y=0.0):
    return lambda u, v: math.hypot(u - x, v - y) - radius


def without(solid, hole):
    return lambda u, v: max(solid(u, v), -hole(u, v))


def union(*parts):
    return lambda u, v: min(part(u, v) for part in parts)


def places(outline, raster):
    """Where the rows are on the object, a millimetre apart."""
    rows = [v for _, v in raster.corners()[::2]]
    left, right = raster.center[0] - 0.5 * raster.width, raster.center[0] + 0.5 * raster.width
    return [(u, v) for v in rows for u in np.arange(left + 2e-4, right, STEP).tolist() if outline(u, v) < -2e-4]


class Rolling(HeightWorld):
    """A ball on a level top with a sharp edge and walls: over the edge, the contact stays."""

    def do(self, leg, strategy):
        if not isinstance(leg, Stroke):
            return super().do(leg, strategy)
        found = []
        heard = SimpleNamespace(feel=lambda felt: found.append(strategy.feel(felt)))
        for corner in leg.corners:  # in small strokes: a strategy may end a leg
            way = math.dist(self.at, corner)
            a, b = np.array(self.at), np.array(corner)
            for t in np.linspace(0.0, 1.0, max(int(way / 2e-4), 1) + 1)[1:]:
                ended = super().do(Stroke((tuple((a + t * (b - a)).tolist()),)), heard)
                if ended.how is not LegEnd.REACHED or (found and found[-1]):
                    return ended
        return ended

    def felt(self, u, v):
        outline, d = self.height, 1e-7
        out = max(outline(u, v), 0.0)
        if out == 0.0:
            return ContactPeriod((u, v, BALL), (u, v, 0.0), (0.0, 0.0, 1.0))
        slope = [outline(u + d, v) - outline(u - d, v), outline(u, v + d) - outline(u, v - d)]
        nu, nv = (k / (2 * d) * min(out / BALL, 1.0) for k in slope)
        normal = (nu, nv, math.sqrt(max(1.0 - nu * nu - nv * nv, 0.0)))
        return ContactPeriod((u, v, BALL * normal[2]), (u - BALL * nu, v - BALL * nv, 0.0), normal)


class Swept:
    """Rows on an object of some outline (negative inside), level, with walls that are too steep.

    A point slides on it; a ball with `sharp`, whose middle may land so far beside the edge [m].
    """

    def __init__(self, outline, raster=RASTER, begin=None, lost=None, sharp=None):
        self.outline, self.raster = outline, raster
        # begin at a place well on the object, as an experiment foresees it
        begin = begin or min(places(outline, raster), key=lambda p: (outline(*p) > -1.5e-3, p[1], p[0]))
        self.strategy, felt = RasterRows(raster, begin=begin), []
        feel = self.strategy.feel
        self.strategy.feel = lambda contact: felt.append(contact.tip[:2]) or feel(contact)  # pyright: ignore[reportAttributeAccessIssue]
        world = (HeightWorld if sharp is None else Rolling)(
            (lambda u, v: -10.0 * max(outline(u, v), 0.0)) if sharp is None else outline,
            steep=math.radians(70.0),
            missing=lambda u, v: outline(u, v) > (5e-4 if sharp is None else sharp),
            lost=lost,
        )
        self.legs = explore(self.strategy, world)
        self.felt = np.array(felt)
        self.hops = [leg for leg in self.legs if isinstance(leg, Hop)]
        self.missed = [mark for mark in self.strategy.marks if mark.event is PathEvent.UNREACHABLE]

    @property
    def share(self):
        """Share of the places on the object that the rows reached."""
        return 1.0 - len(self.unfelt) / len(places(self.outline, self.raster))

    @property
    def unfelt(self):
        """Places on the object that the rows did not reach."""
        near = {v: self.felt[np.abs(self.felt[:, 1] - v) < 4e-4, 0] for _, v in places(self.outline, self.raster)}
        return [p for p in places(self.outline, self.raster) if np.abs(near[p[1]] - p[0]).min(initial=1.0) >= STEP]

    @property
    def way(self):
        """Length of the sweeps [m]."""
        steps = np.hypot(*np.diff(self.felt, axis=0).T)
        return steps[steps < STEP].sum()

    @property
    def pieces(self):
        """Number of parts into which the object cuts the rows."""
        across, rows = np.arange(-0.025, 0.025, 2e-4), self.raster.corners()[::2]
        inside = np.array([[False, *(self.outline(u, v) < -2e-4 for u in across)] for _, v in rows])
        return int((inside[:, 1:] & ~inside[:, :-1]).sum())


SHAPES = {
    "box": box(0.0, 0.0, 0.03, 0.02),
    "box in a corner": box(0.015, 0.015, 0.02, 0.02),
    "disc": disc(0.018),
    "ring": without(disc(0.022), disc(0.01)),
    "two islands": union(box(-0.014, -0.012, 0.016, 0.014), box(0.013, 0.01, 0.018, 0.016)),
    "L": union(box(-0.012, 0.0, 0.012, 0.04), box(0.0, -0.014, 0.036, 0.012)),
    "U": union(box(-0.016, 0.0, 0.01, 0.04), box(0.016, 0.0, 0.01, 0.04), box(0.0, 0.016, 0.04, 0.01)),
    "slit": without(box(0.0, 0.0, 0.044, 0.044), box(0.003, 0.0, 0.002, 0.1)),
    "small hole": without(box(0.0, 0.0, 0.044, 0.044), disc(0.004, 0.008)),
}


@pytest.mark.parametrize("name", SHAPES)
def test_whatever_the_outline_all_of_it_is_swept_with_few_landings(name):
    swept = Swept(SHAPES[name])
    assert swept.share >= 0.95
    # a landing for each side of each piece; four in vain for each part's ends; the logarithm of 700 mm to probe
    assert len(swept.hops) <= 2 * swept.pieces + 14 + math.log2(700)
    # no more than once, and what a landing lies inwards of the rim twice
    assert swept.way <= STEP * len(places(SHAPES[name], RASTER)) + 4e-3 * swept.pieces + 2 * RASTER.spacing


@pytest.mark.slow
@pytest.mark.parametrize("name", SHAPES)
def test_round_a_sharp_rim_the_tip_turns_without_a_second_landing(name):
    swept = Swept(SHAPES[name], sharp=2e-3)
    assert swept.share >= 0.95
    assert len(swept.hops) <= 3 * len(RASTER.corners()) / 2 + 8


def test_where_the_object_fills_the_field_it_is_the_raster():
    """A loss ends it with a mark."""
    swept = Swept(lambda u, v: -1.0, begin=RASTER.corners()[0])
    corners = [corner for leg in swept.legs if isinstance(leg, Stroke) for corner in leg.corners]
    turns = [c for k, c in enumerate(corners) if k == 0 or math.dist(c, corners[k - 1]) > 1e-9]
    assert len(swept.hops) == 1
    assert swept.share == 1.0
    assert np.array(turns) == pytest.approx(np.array(RASTER.corners()))
    assert swept.strategy.marks == ()
    assert Swept(SHAPES["box"], lost=lambda u, v: u > 0.0).strategy.marks[-1].event is PathEvent.LOST


@settings(max_examples=12, deadline=None, derandomize=True)
@given(
    st.floats(0.01, 0.02),
    st.floats(-5e-3, 5e-3),
    st.floats(-5e-3, 5e-3),
    st.floats(0.0, 2 * math.pi),
    st.floats(0.5, 1.0),
)
def test_of_an_ellipse_anywhere_in_any_direction_every_row_longer_than_8_mm_is_swept(a, x, y, turn, ratio):
    """Rows that cut off less are found only if a hop from the row before lands on them."""
    c, s = math.cos(turn), math.sin(turn)

    def outline(u, v):
        p, q = c * (u - x) + s * (v - y), -s * (u - x) + c * (v - y)
        return math.hypot(p, q / ratio) * ratio - a * ratio

    swept = Swept(outline)
    assert swept.share >= 0.8
    assert max(np.unique([v for _, v in swept.unfelt], return_counts=True)[1], default=0) * STEP <= 8e-3
    assert len(swept.hops) <= 3 * len(RASTER.corners()) / 2 + 10


@settings(max_examples=8, deadline=None, derandomize=True)
@given(st.floats(1e-3, 0.012), st.floats(-0.012, 0.012))
def test_behind_a_hole_of_any_width_rows_go_on(width, at):
    """Both sides are swept to its rims: rows above and below show them."""
    assert Swept(without(box(0.0, 0.0, 0.044, 0.03), box(at, 0.0, width, 0.016))).share >= 0.95


def test_a_second_landing_in_the_middle_is_the_last_where_there_is_nothing():
    strategy = RasterRows(RASTER)
    legs = explore(strategy, HeightWorld(lambda u, v: 0.0, missing=lambda u, v: True))
    assert legs == [Hop(RASTER.corners()[0]), Hop((0.0, 0.0))]
    assert [mark.event for mark in strategy.marks] == [PathEvent.UNREACHABLE] * 2
    again = explore(strategy, HeightWorld(lambda u, v: 0.0, missing=lambda u, v: True))
    assert again == legs
    assert len(strategy.marks) == 2  # a second start forgets the marks of the first


@settings(max_examples=6, deadline=None, derandomize=True)
@given(st.integers(1, 6))
def test_on_nothing_the_number_of_tries_grows_with_the_logarithm_of_its_size(doublings):
    side = 0.01 * 2**doublings
    raster = Raster(side, side, 0.004, (0.5 * side - 0.002, 0.5 * side - 0.002))
    swept = Swept(box(0.0, 0.0, 0.006, 0.010), raster)
    assert len(swept.missed) <= 12 + 2 * math.log2(side**2 / 4e-6)
    assert swept.share >= 0.95


def test_what_lies_across_the_path_to_the_next_row_is_passed_by():
    """A wall between two rows, at their ends only: the next row is landed on instead."""
    raster = Raster(0.02, 0.008, 0.004)
    swept = Swept(
        lambda u, v: 5e-4 if u > 8e-3 and abs(v + 2e-3) < 1e-3 else -1.0, raster, begin=raster.corners()[0]
    )
    assert swept.share >= 0.95
    assert len(swept.hops) <= 4
