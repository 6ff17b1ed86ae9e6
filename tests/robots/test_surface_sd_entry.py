"""How well a fingertip is known, as robot files say it."""

import msgspec
import numpy as np
import pytest

from palpate.robots.surface_sd_entry import SurfaceSdEntry

FITTED = np.diag([1e-8] * 3 + [1e-4] * 3 + [1e-10, 1e-2])
FITTED[0, 6] = FITTED[6, 0] = 0.9e-9


def test_a_covariance_says_as_much_as_standard_deviations_and_more():
    fitted = msgspec.convert({"covariance": FITTED.tolist()}, SurfaceSdEntry).uncertainty
    typed = msgspec.convert(
        {"position_m": 1e-4, "rotation_rad": 0.01, "size_m": 1e-5, "stiffness": 0.1}, SurfaceSdEntry
    ).uncertainty
    np.testing.assert_allclose(fitted.covariance, FITTED)
    np.testing.assert_allclose(np.diag(fitted.covariance), np.diag(typed.covariance))


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ({"covariance": FITTED.tolist(), "size_m": 1e-5}, "leave them out"),
        ({"covariance": (1e6 * FITTED).tolist()}, "position_m"),
        ({"covariance": (-FITTED).tolist()}, "negative eigenvalues"),
        ({"size_m": -1e-5}, "size_m"),
        ({"rotation_rad": 3.0}, "another unit"),
    ],
)
def test_what_cannot_be_is_refused(typed, said):
    with pytest.raises(msgspec.ValidationError, match=said):
        msgspec.convert(typed, SurfaceSdEntry)
