"""What a review found: pressing on what goes away, lifts that get nowhere, files inside out, values not finite."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers import ConstantForce, IdentifyController, IdentifyParameters, LandingModel, force_gain
from palpate.controllers.identification import PressRecord, identify
from palpate.controllers.paths import PathPlane, Waypoints
from palpate.controllers.regulate import RegulateController
from palpate.controllers.regulate_parameters import RegulateParameters
from palpate.errors import InvalidValueError
from palpate.experiments.explore.error_budget import landed_stiffness
from palpate.mapping import PrimitiveKind, TouchCloud
from palpate.mapping.compare import TouchedMap, compare
from palpate.mapping.compare_files import read_map, read_reference
from palpate.mapping.compare_surface import TriangleSurface
from palpate.mapping.primitives import fit_primitive
from palpate.mapping.rolling import rolled_curvature
from palpate.mapping.surface_map.model import SurfaceModel
from palpate.mapping.surface_map.stretches import Stretches
from palpate.runtime import Finger, Phase, Touch
from palpate.surfaces import Sphere
from support.spring_world import PERIOD, RADIUS, SpringWorld

DELAY = 5
"""Of the commands, in periods: a robot without any would be told apart from none."""


def pressed(controller, *, leaves=lambda: False, hold=lambda position, move: move, seconds=60.0):
    """Run on a floor that drops by 50 mm when `leaves` says so: final phase (None: never), time, commands."""
    gone = False
    world = SpringWorld(lambda p: p[2] + (0.05 if gone else 0.0), (0.0, 0.0, 0.006), hold=hold)
    touch, commands = Touch(Finger(Sphere(RADIUS))), [(0.0, 0.0, 0.0)] * DELAY
    controller.start(touch.sense(world.sample()))
    left_at = math.inf
    while world.time < seconds:
        gone = gone or leaves()
        left_at = min(left_at, world.time) if gone else left_at
        command = controller.step(touch.sense(world.sample()))
        if command.phase.is_final:
            return command.phase, world.time - left_at
        commands.append(command.velocity_base_tip)
        world.move(commands.pop(0))
    return None, math.inf


@pytest.mark.slow
@pytest.mark.parametrize(
    ("doing", "count"),
    [("ramps", 0), ("ramps", 1), ("ramps", 2), ("to the middle", 5), ("sines", 0), ("sines", 3), ("sines", 7)],
)
def test_pressing_on_what_goes_away_ends_soon_and_finds_nothing(doing, count):
    """Just after a turn the next ramp would be as slow as the last one was short; a sine would see no force."""
    controller = IdentifyController(IdentifyParameters(), PERIOD)

    def leaves():
        so_far = controller._tone if doing == "sines" else controller._turns
        return controller._doing.value == doing and so_far == count

    phase, after = pressed(controller, leaves=leaves)
    assert phase is Phase.LOST
    assert after < 1.0  # 0.2 s of waiting, and a lift of 5 mm at 20 mm/s
    with pytest.raises(InvalidValueError, match="nothing was identified"):
        controller.result()


def held_down(phase_of):
    """Lets the tip go down, but not up once the controller lifts it."""
    return lambda position, move: move * [1.0, 1.0, 0.0] if phase_of() is Phase.LIFT and move[2] > 0.0 else move


def test_a_lift_that_gets_nowhere_ends():
    gain = force_gain(20e3, 0.02)
    parameters = RegulateParameters(gain, 0.01, 0.5, 2.0, (0.5, 5.0))
    regulate = RegulateController(parameters, ConstantForce(2.0), PERIOD)
    identify_first = IdentifyController(IdentifyParameters(press_distance=1e-4), PERIOD)
    for controller, ending in ((regulate, Phase.DONE), (identify_first, Phase.LOST)):
        hold = held_down(lambda controller=controller: controller.contact.phase)
        assert pressed(controller, hold=hold, seconds=30.0)[0] is ending


def test_a_landing_tells_the_stiffness_where_the_robot_tells_no_velocity():
    depth = np.linspace(0.0, 1e-4, 200)
    normal, still = np.tile([0.0, 0.0, -1.0], (200, 1)), np.zeros((200, 3))
    record = SimpleNamespace(
        phase=np.full(200, Phase.SETTLE.value),
        touching=np.ones(200, bool),
        status=np.zeros(200, int),
        normal_force=20e3 * depth,
        normal=normal,
        position=depth[:, None] * normal,
        velocity=still,
    )
    assert landed_stiffness(record) == pytest.approx(20e3, rel=1e-6)


def test_ramps_of_a_sample_or_two_are_refused_as_too_short():
    for count in range(3):
        row = np.zeros(count)
        with pytest.raises(InvalidValueError, match=r"0 steady samples"):
            identify(PressRecord(row, row, row, np.zeros(count, bool), 1e-3), (), 0.0)


def sphere_mesh(radius=0.02):
    made = trimesh.creation.icosphere(3, radius)
    return TriangleSurface(made.vertices, made.faces)


MIRRORED = ((-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
NOT_A_PLACE = np.array([[0.0, 0.0, 0.02], [np.nan, 0.0, 0.0]])
NOT_FINITE = ((math.nan, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: LandingModel(2e4, 0.02, 2e4).speed(2.0, math.nan), "touch_force = nan"),
        (lambda: PathPlane(rotation_base_plane=MIRRORED), "reflection"),
        (lambda: PathPlane(rotation_base_plane=NOT_FINITE), "finite"),
        (lambda: PathPlane(origin=(0.0, math.inf, 0.0)), "finite"),
        (lambda: Waypoints(((0.0, 0.0), (math.inf, 0.0))), "finite"),
        (
            lambda: compare(TouchedMap(NOT_A_PLACE), sphere_mesh()),
            r"point 1 of the map is \[nan",
        ),
        (lambda: sphere_mesh().samples(0), "0 samples"),
    ],
)
def test_a_value_that_is_not_finite_is_refused(call, message):
    with pytest.raises(InvalidValueError, match=message):
        call()


def sphere_file(path, radius, step):
    """Write a sphere beside the origin; a step of -1 lists the corners of its triangles the other way round."""
    made = trimesh.creation.icosphere(3, radius)
    made.apply_translation((1.0, -2.0, 0.5))
    trimesh.Trimesh(made.vertices, made.faces[:, ::step], process=False).export(path)
    return path


@pytest.mark.parametrize("reference", [1, -1], ids=["outwards", "inwards"])
@pytest.mark.parametrize("touched", [1, -1], ids=["outwards", "inwards"])
def test_a_closed_file_whose_triangles_face_inwards_is_measured_like_any_other(reference, touched, tmp_path):
    """Reference and map: which way round a file lists its corners changes neither sign nor normals."""
    surface = read_reference(sphere_file(tmp_path / "reference.stl", 0.02, reference))
    found = compare(
        read_map(sphere_file(tmp_path / "map.stl", 0.0203, touched), samples=2000), surface, samples=2000
    )
    assert found.bias == pytest.approx(3e-4, rel=0.02)
    assert np.degrees(found.normal_error).max() < 10.0


def felt(position, normal):
    count = len(position)
    return TouchCloud(
        np.arange(count, dtype=float), position, normal, np.ones(count), np.zeros((count, 3)), np.zeros(count)
    )


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("count", [10, 20, 40])
def test_contacts_on_the_axis_of_a_fit_do_no_harm(count):
    """Both faces of a sheet without thickness: the first cylinder tried has its axis amid the contacts."""
    position = np.column_stack([np.linspace(0.0, 0.01, count), np.zeros(count), np.zeros(count)])
    facing = np.zeros((count, 3))
    facing[:, 2] = 1.0 - 2.0 * (np.arange(count) % 2)
    fit = fit_primitive(felt(position, facing), PrimitiveKind.CYLINDER)
    assert np.isfinite(fit.distance).all()


@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.floats(0.1, 10.0))
def test_how_sure_rolled_curvature_is_goes_by_the_noise_that_was_told(told):
    """Half the noise in the model, twice as much in every contact: the same noise, the same deviation."""
    rng = np.random.default_rng(2)
    u, v = (each.ravel() for each in np.meshgrid(np.arange(-3, 4) * 1e-3, np.arange(-3, 4) * 1e-3))
    lean = 25.0 * np.stack([u, v], axis=1) + np.radians(0.5) * rng.normal(size=(len(u), 2))
    normal = np.column_stack([lean, np.ones(len(u))])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    place, one = np.column_stack([u, v, -12.5 * (u * u + v * v)]), np.ones(len(u))
    path = 5e-3 * np.arange(len(u))
    model = SurfaceModel()
    top, up = np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]])
    by_model = rolled_curvature(Stretches(place, normal, path, 0.0 * one, one, one), top, up, model, 3e-3)
    lower = SurfaceModel(tilt=model.tilt / told)
    by_contact = rolled_curvature(Stretches(place, normal, path, 0.0 * one, one, told * one), top, up, lower, 3e-3)
    assert by_contact.mean_sd[0] == pytest.approx(by_model.mean_sd[0], rel=1e-9)
