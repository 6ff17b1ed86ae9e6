import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.reporting.envelope import envelope


@settings(max_examples=200, deadline=None)
@given(count=st.integers(1, 3000), bins=st.integers(1, 200), missing=st.floats(0.0, 1.0), seed=st.integers(0, 99))
def test_extremes_ends_and_order_are_kept(count, bins, missing, seed):
    rng = np.random.default_rng(seed)
    time, value = np.arange(count) * 0.5, rng.normal(size=count)
    value[rng.random(count) < missing] = np.nan
    t, v = envelope(time, value, bins)
    assert len(t) == len(v) <= max(3 * bins + 2, 2 * bins)
    assert (np.diff(t) > 0.0).all()
    np.testing.assert_array_equal(v, value[(2 * t).astype(int)])  # samples of the series, not made up
    if np.isfinite(value).any():
        assert np.nanmin(v) == np.nanmin(value)
        assert np.nanmax(v) == np.nanmax(value)
    assert t[0] == time[0]
    assert t[-1] == time[-1]
    assert np.isnan(v).any() == np.isnan(value).any()


def test_every_bin_keeps_its_peak():
    time = np.arange(100_000.0)
    value = np.zeros_like(time)
    peaks = np.random.default_rng(0).choice(100_000, 50, replace=False)
    value[peaks] = 1.0 + peaks
    t, v = envelope(time, value, 1000)
    kept = set(t[v > 0].tolist())
    by_bin = {}
    for peak in peaks.tolist():
        by_bin[peak // 100] = max(peak, by_bin.get(peak // 100, 0))
    assert kept >= set(map(float, by_bin.values()))


def test_short_series_are_drawn_as_they_are():
    time = np.arange(20.0)
    t, v = envelope(time, time**2, 10)
    assert t is time
    np.testing.assert_array_equal(v, time**2)


def test_a_gap_stays_a_gap():
    value = np.ones(10_000)
    value[5000] = np.nan
    t, v = envelope(np.arange(10_000.0), value, 50)
    assert t[np.isnan(v)].tolist() == [5000.0]
