"""What a sensor's noise does to contacts is what it does to the grasp made of them."""

import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.friction import LimitSurface
from palpate.grasp.from_touch import grasp_from_touch
from palpate.grasp.touch_uncertainty import uncertainty_from_touch
from palpate.kinematics import Pose
from palpate.kinematics.pose import rotation_from_rotvec
from palpate.sensing.solver import contact_from_wrench
from palpate.sensing.uncertainty import contact_uncertainty, white_noise
from palpate.surfaces import Ellipsoid

TIP = Ellipsoid((0.008, 0.009, 0.012))
WRENCH = np.array([0.3, 0.1, -2.0, 0.004, 0.008, 0.001])
NOISE = white_noise(0.005, 2e-5)
POSE = Pose((0.02, -0.01, 0.03), rotation_from_rotvec((0.4, -1.1, 0.7)))


def test_places_and_normals_scatter_as_told():
    """Wrenches with noise, each made into a grasp: the sample covariance of its positions and normals."""
    contact = contact_from_wrench(TIP, WRENCH)
    known = contact_uncertainty(TIP, contact, NOISE)
    gone = contact_from_wrench(TIP, np.zeros(6))
    found = uncertainty_from_touch([gone, contact], [known, known], [POSE, POSE], [0.1], [0.001])
    drawn = np.random.default_rng(0).multivariate_normal(WRENCH, NOISE, 4000)
    surface = [LimitSurface(0.5, 0.005)]
    grasps = [grasp_from_touch([contact_from_wrench(TIP, each)], [POSE], surface) for each in drawn]
    places = np.array([each.grasp.positions[0] for each in grasps if each is not None])
    normals = np.array([each.grasp.frames[0, :, 0] for each in grasps if each is not None])
    middle = grasp_from_touch([contact], [POSE], surface)
    assert middle is not None
    tangents = middle.grasp.frames[0, :, 1:]
    assert found.position[0] == pytest.approx(np.cov(places.T), abs=0.1 * found.position.max())
    assert found.normal[0] == pytest.approx(np.cov((normals @ tangents).T), abs=0.1 * found.normal.max())


def test_what_does_not_go_together_is_refused():
    contact = contact_from_wrench(TIP, WRENCH)
    with pytest.raises(InvalidValueError, match="1 contacts, 0 uncertainties, 1 poses"):
        uncertainty_from_touch([contact], [], [POSE], [0.1], [0.001])
    with pytest.raises(InvalidValueError, match="none has status OK"):
        uncertainty_from_touch([], [], [], [], [])
