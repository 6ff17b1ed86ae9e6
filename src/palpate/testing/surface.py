"""Check of a fingertip's surface."""

import inspect
import math
from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, shown
from palpate.sensing.contact import Contact, ContactModel, Contacts, ContactStatus
from palpate.sensing.solver import Solver, Surface, contact_from_wrench, contacts_from_wrenches
from palpate.surfaces.compliant import CompliantTip
from palpate.surfaces.composite import Composite
from palpate.surfaces.implicit import DIFFERENCE_STEP, GRADIENT_TOLERANCE, Implicit
from palpate.testing.nonconformity import Inspection

BAD_ROTATIONS = (
    2.0 * np.eye(3),
    np.round([[0.6 * 2**0.5, -(0.28**0.5), 0.0], [0.28**0.5, 0.6 * 2**0.5, 0.0], [0.0, 0.0, 1.0]], 4),
    np.diag([1.0, 1.0, -1.0]),
    np.eye(2),
    np.eye(4),
)
"""Matrices that are no rotations: not orthonormal, rounded to four decimals, a reflection, other shapes."""


def examine_construction(inspection: Inspection, piece: object) -> None:
    """Construct a piece again with bad numbers in one argument at a time: each must be refused.

    Only a class that keeps its arguments under their names can be constructed again.
    """
    names = inspect.signature(type(piece)).parameters
    if not all(hasattr(piece, name) for name in names):
        return
    given = {name: getattr(piece, name) for name in names}
    for name, value in given.items():
        for bad in _bad(name, value):
            what = f"{type(piece).__name__}({name}={shown(bad)})"
            inspection.refuses(what, type(piece), names=name, **{**given, name: bad})


def _bad(name: str, value: object) -> Iterator[object]:
    """Yield invalid values of the same type."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        yield math.nan
    elif isinstance(value, tuple | np.ndarray):
        array = np.array(value, dtype=object)
        if array.size and all(isinstance(entry, float) for entry in array.ravel()):
            array.flat[0] = math.nan
            yield array.astype(float)
            if array.shape == (3,):
                yield from (np.ones(2), np.ones((3, 1)), np.full(3, math.nan), ("a", "b", "c"), None)
            if name == "rotation":
                yield from BAD_ROTATIONS


WRENCH_COUNT = 64
"""Number of wrenches per property: a surface of plain Python functions takes some seconds."""

MAX_CONDITION = 1e3
"""Largest condition number of contacts that are judged: beyond, six digits would be lost there and back."""

RELATIVE_TOLERANCE = 1e-8
"""Largest error relative to the size: rounding times the condition number times the tolerance of iterations."""

WRENCH_CHANGE = 1e-5
"""Relative change of wrenches that moves the contact: its square is below `RELATIVE_TOLERANCE`."""

MAX_SIZE, MIN_SIZE = 0.5, 1e-6
"""Limits of radii of curvature [m], as in robot files: beyond, they are in another unit."""


def check_surface(surface: Surface, normal_tolerance: float = 1e-3) -> None:
    """Check a fingertip: frame, units, refusals, and that contacts solve the equations that define them.

    No formula of the surface is needed. Contacts give points of the surface, and neighbouring contacts its tangent
    planes. Contacts that are constructed at these points must be found again, also under larger forces.

    Args:
        surface: Surface of the fingertip, sensor frame.
        normal_tolerance: Largest angle between the normal and that of the surface [rad]: for meshes, whose normals
            are interpolated, about the angle between neighbouring facets.

    Raises:
        ConformanceError: If the surface breaks a rule.
    """
    with Inspection(type(surface).__name__) as inspection:
        _examine_frame(inspection, surface)
        with inspection.part("constructing it again with bad values"):
            examine_construction(inspection, surface)
        with inspection.part("solving wrenches that are none"):
            _examine_refusals(inspection, surface)
        if isinstance(surface, Implicit):
            with inspection.part("evaluating it about its centre"):
                _examine_level(inspection, surface, max(normal_tolerance, 10.0 * GRADIENT_TOLERANCE))
            if inspection.found("gradient"):
                return  # contacts would show the same error, later
        with inspection.part("solving contacts"):
            touched = _touched(inspection, surface)
            if touched is not None:
                _examine_equations(inspection, touched)
                _examine_shape(inspection, touched, normal_tolerance)
                _examine_round_trip(inspection, touched)
                _examine_wrench_axis(inspection, touched)


@dataclass(frozen=True, slots=True, eq=False)
class _Touched:
    """Well-conditioned contacts of a surface of radius `size` [m], and their wrenches, shape (n, 6)."""

    surface: Surface
    size: float
    wrenches: FloatArray
    contacts: Contacts

    @property
    def points(self) -> FloatArray:
        """Points on the surface without load, shape (n, 3) [m]."""
        return _unloaded(self.surface, self.contacts)

    @property
    def precision(self) -> float:
        """Precision of a position [m]: an origin far from the surface costs digits."""
        return float(RELATIVE_TOLERANCE * max(self.size, np.linalg.norm(self.contacts.centroid, axis=1).max()))


def _unloaded(surface: Surface, contacts: Contacts) -> FloatArray:
    if not isinstance(surface, CompliantTip):
        return contacts.centroid
    depth = [surface.indentation(force) for force in contacts.normal_force.tolist()]
    return np.asarray(contacts.centroid + np.array(depth)[:, None] * contacts.normal)


def _center(surface: Surface) -> FloatArray:
    if isinstance(surface, Composite):
        return np.asarray(np.mean([patch.surface.center for patch in surface.patches], axis=0))
    return np.asarray(surface.center)


def _pushes(rng: np.random.Generator, center: FloatArray, lever: float) -> FloatArray:
    """Return wrenches of about 1 N that pass the centre at about `lever` [m]."""
    force, spin = rng.normal(size=(2, WRENCH_COUNT, 3))
    return np.hstack([force, np.cross(center, force) + lever * spin])


def _well(contacts: Contacts) -> npt.NDArray[np.bool_]:
    return np.asarray((contacts.status == ContactStatus.OK) & (contacts.condition < MAX_CONDITION))


def _touched(inspection: Inspection, surface: Surface) -> _Touched | None:
    rng, center = np.random.default_rng(0), _center(surface)
    through = contacts_from_wrenches(surface, _pushes(rng, center, 1e-6))
    ok = through.status == ContactStatus.OK
    c, n = _unloaded(surface, through)[ok], through.normal[ok]
    apart = np.linalg.norm(n[:, None] - n[None], axis=2)
    several = inspection.require(
        (apart > 0.3).any(),
        "contacts",
        f"{ok.sum()} contacts for {WRENCH_COUNT} wrenches through the centre, with hardly different normals",
        "a contact for most of them",
        "value and gradient, or where center is: inside a closed surface, on the axis of an open one",
    )
    if not several:
        return None
    size = float(np.median((np.linalg.norm(c[:, None] - c[None], axis=2)[apart > 0.3]) / apart[apart > 0.3]))
    inspection.require(
        MIN_SIZE <= size <= MAX_SIZE,
        "units",
        f"a radius of about {size:.3g} m",
        f"a fingertip between {MIN_SIZE:g} and {MAX_SIZE:g} m",
        "give lengths in metres, not in millimetres",
    )
    rows = _pushes(rng, center, 0.3 * size)
    found = contacts_from_wrenches(surface, rows)
    well = _well(found)
    enough = inspection.require(
        well.sum() >= 0.1 * WRENCH_COUNT,
        "contacts",
        f"{well.sum()} well-conditioned contacts for {WRENCH_COUNT} wrenches",
        "one for most of them",
        "value and gradient: the solver finds no point where the normal balances the wrench",
    )
    return _Touched(surface, size, rows[well], contacts_from_wrenches(surface, rows[well])) if enough else None


def _examine_equations(inspection: Inspection, touched: _Touched) -> None:
    """Contacts must balance force and moment, m = c x f + q n and f = f_t - f_n n, and push the surface."""
    at, rows = touched.contacts, touched.wrenches
    f, m = rows[:, :3], rows[:, 3:]
    numbers = (at.centroid, at.normal, at.tangential_force, at.normal_force, at.spin_torque)
    if not inspection.require(
        all(np.isfinite(each).all() for each in numbers),
        "silent NaN",
        "status OK with numbers that are none",
        "a status other than OK where there is no contact",
        "the solver of this kind of surface: set the status",
    ):
        return
    left = m - np.cross(at.centroid, f) - at.spin_torque[:, None] * at.normal
    limit = RELATIVE_TOLERANCE * (touched.size + np.linalg.norm(at.centroid, axis=1)) * np.linalg.norm(f, axis=1)
    inspection.require(
        (np.linalg.norm(left, axis=1) <= limit).all(),
        "balance of moments",
        f"m - c x f - q n up to {np.abs(left).max():.1e} N m",
        "0",
        "the centroid: force comes before moment, and the moment is about the sensor's origin, in N m",
    )
    inspection.require(
        np.allclose(np.linalg.norm(at.normal, axis=1), 1.0, rtol=0.0, atol=RELATIVE_TOLERANCE),
        "unit normals",
        f"normals of length {np.linalg.norm(at.normal, axis=1).max():.6g}",
        "length 1",
        "a rotation that is not orthonormal, or a normal that was not divided by its length",
    )
    parts = at.tangential_force - at.normal_force[:, None] * at.normal - f
    inspection.require(
        (at.normal_force > 0.0).all() and np.abs(parts).max() <= RELATIVE_TOLERANCE * np.abs(f).max(),
        "parts of the force",
        f"normal forces from {at.normal_force.min():.3g} N, f_t - f_n n - f up to {np.abs(parts).max():.1e} N",
        "f_n above 0 and f = f_t - f_n n",
        "the normal points out of the fingertip and the wrench is what the object exerts on the finger: -f.n > 0",
    )
    mixed = np.insert(rows, (1, len(rows)), ((math.nan,) * 6, (0.0,) * 6), axis=0)
    many, alone = (
        contacts_from_wrenches(touched.surface, mixed),
        [Solver(touched.surface)(row) for row in mixed],  # a new solver each time
    )
    inspection.require(
        all(
            np.array_equal(getattr(many, field.name), [getattr(one, field.name) for one in alone], equal_nan=True)
            for field in fields(Contact)
        ),
        "purity",
        "other contacts for the same wrenches, or for one alone",
        "the same bit for bit",
        "state that the surface's functions keep between calls",
    )


def _examine_shape(inspection: Inspection, touched: _Touched, normal_tolerance: float) -> None:
    """Every point must lie below the tangent plane of every other point; neighbours must lie in it."""
    x, n = touched.points, touched.contacts.normal
    above = np.einsum("ijk,ik->ij", x[None] - x[:, None], n)
    beyond = above > touched.precision + normal_tolerance * np.linalg.norm(x[None] - x[:, None], axis=2)
    if beyond.sum() > 0.25 * beyond.size:
        inspection.require(
            False,
            "outward normals",
            f"{beyond.sum()} of {beyond.size} pairs of points lie outside one another's tangent plane",
            "normals that point out of the fingertip, into the object",
            "the sign of the gradient: value is negative inside",
        )
        return
    inspection.require(
        not beyond.any(),
        "convexity",
        f"a point lies {1e3 * above.max():.3g} mm outside the tangent plane of another one",
        "a convex surface, whose normal is that of the surface at the centroid",
        "the shape, or the gradient, which must be that of value",
    )
    rng = np.random.default_rng(1)
    change = WRENCH_CHANGE * rng.normal(size=touched.wrenches.shape)
    change[:, 3:] *= touched.size
    center = _center(touched.surface)
    change[:, 3:] += np.cross(center, change[:, :3])
    moved = contacts_from_wrenches(touched.surface, touched.wrenches + change)
    ok = moved.status == ContactStatus.OK
    step = (_unloaded(touched.surface, moved) - x)[ok]
    length = np.linalg.norm(step, axis=1)
    far = length > 1e-8 * touched.size  # a flat face gives no information
    if far.any():
        slope = np.abs(np.sum(step * n[ok], axis=1))[far] / length[far]
        limit = normal_tolerance + length[far] / touched.size + touched.precision * 1e-4 / length[far]
        inspection.require(
            np.mean(slope <= limit) > 0.95,  # the others crossed a seam
            "normals",
            f"the contact moves at an angle of {np.median(slope):.2g} rad to the surface that its normal says",
            f"at most {normal_tolerance:g} rad",
            "the gradient: it must be that of value, in the surface's own frame",
        )


def _examine_round_trip(inspection: Inspection, touched: _Touched) -> None:
    """Contacts constructed at known points must be found again, under forces of any size."""
    at, surface, x = touched.contacts, touched.surface, touched.contacts.centroid
    rng = np.random.default_rng(2)
    aside = np.cross(at.normal, rng.normal(size=x.shape))
    rigid = not isinstance(surface, CompliantTip)
    for scale in (1.0, 2.0**-10, 2.0**10) if rigid else (1.0,):
        force = scale * at.normal_force[:, None] * (0.3 * aside - at.normal)
        spin = 0.1 * touched.size * scale * rng.normal(size=len(x)) * at.normal_force
        found = contacts_from_wrenches(surface, np.hstack([force, np.cross(x, force) + spin[:, None] * at.normal]))
        well = _well(found)
        off = np.linalg.norm(found.centroid - x, axis=1)[well]
        turn = np.linalg.norm(found.normal - at.normal, axis=1)[well]
        inspection.require(
            well.sum() >= 0.5 * len(x)
            and (off <= 1e2 * touched.precision).all()
            and (
                turn
                <= 1e2 * RELATIVE_TOLERANCE * max(1.0, touched.precision / (RELATIVE_TOLERANCE * touched.size))
            ).all(),
            "round trip",
            f"of {len(x)} contacts made up on the surface {well.sum()} were found, up to "
            f"{1e6 * off.max(initial=0.0):.3g} um and {turn.max(initial=0.0):.2g} rad away, at force x {scale:g}",
            "the same contacts",
            "the normal belongs to another point than the centroid, or the solver stops too early",
        )


def _examine_wrench_axis(inspection: Inspection, touched: _Touched) -> None:
    """With the hard model, the centroid must lie on the wrench axis, where the force pushes."""
    found = contacts_from_wrenches(touched.surface, touched.wrenches, "hard")
    well = _well(found)
    f, m = touched.wrenches[well, :3], touched.wrenches[well, 3:]
    off = np.linalg.norm(np.cross(m - np.cross(found.centroid[well], f), f), axis=1) / np.sum(f * f, axis=1)
    inspection.require(
        (off <= 1e2 * touched.precision).all() and (found.normal_force[well] > 0.0).all(),
        "wrench axis",
        f"with the hard model the centroid lies up to {1e6 * off.max(initial=0.0):.3g} um beside the wrench axis",
        "a centroid on it, where the force points into the surface",
        "the solver of this kind of surface with hard = True",
    )


def _examine_frame(inspection: Inspection, surface: Surface) -> None:
    if isinstance(surface, Composite):
        for patch in surface.patches:
            _examine_frame(inspection, patch.surface)
        _examine_arrays(inspection, surface)
        return
    rotation, center = np.asarray(surface.rotation), np.asarray(surface.center)
    inspection.require(
        rotation.shape == (3, 3)
        and np.allclose(rotation.T @ rotation, np.eye(3), rtol=0.0, atol=1e-9)
        and np.linalg.det(rotation) > 0.0,
        "rotation",
        f"rotation = {rotation.tolist()}",
        "an orthonormal matrix with determinant 1, whose columns are the surface's axes in sensor coordinates",
        "pass it through `palpate.errors.rotation_matrix`",
    )
    inspection.require(
        center.shape == (3,) and np.isfinite(center).all(),
        "center",
        f"center = {center.tolist()}",
        "three finite numbers [m]",
        'pass it through `palpate.errors.vector("center", center, 3, "m")`',
    )
    _examine_arrays(inspection, surface)


def _examine_arrays(inspection: Inspection, surface: Surface) -> None:
    writeable = [
        name
        for name, value in getattr(surface, "__dict__", {}).items()
        if isinstance(value, np.ndarray) and value.flags.writeable
    ]
    inspection.require(
        not writeable,
        "immutability",
        f"{', '.join(writeable)} can be written to",
        "arrays that cannot change while a controller runs",
        "copy what is given and call setflags(write=False)",
    )


def _examine_refusals(inspection: Inspection, surface: Surface) -> None:
    good = np.array([0.1, 0.2, -1.0, 1e-3, 2e-3, 3e-3])
    kept = good.copy()
    for i in range(6):
        for bad in (math.nan, math.inf):
            wrench = good.copy()
            wrench[i] = bad
            _examine_status(inspection, surface, wrench, ContactStatus.INVALID)
    _examine_status(inspection, surface, np.array([0.0, 0.0, 0.0, 0.0, 1e-3, 0.0]), ContactStatus.NO_FORCE)
    for shape in ((), (3,), (5,), (7,), (1, 6), (6, 1)):
        inspection.refuses(
            f"a wrench of shape {shape}", contact_from_wrench, surface, np.ones(shape), names="wrench"
        )
    inspection.refuses("a wrench that is None", contact_from_wrench, surface, None, names="wrench")
    inspection.refuses('model = "sof"', contact_from_wrench, surface, good, "sof", names="model")
    contact_from_wrench(surface, good)
    inspection.require(
        np.array_equal(good, kept),
        "inputs",
        "the wrench that was handed in has changed",
        "the caller's array as it was",
        "copy it before writing",
    )


def _examine_status(inspection: Inspection, surface: Surface, wrench: FloatArray, status: ContactStatus) -> None:
    models: tuple[ContactModel, ...] = ("soft", "hard")
    for model in models:
        found = contact_from_wrench(surface, wrench, model)
        numbers = (found.centroid, found.normal, found.tangential_force, found.normal_force, found.spin_torque)
        inspection.require(
            found.status is status and all(np.isnan(number).all() for number in numbers),
            "status",
            f"wrench {wrench.tolist()} gives status {found.status.name}, centroid {found.centroid.tolist()}",
            f"{status.name}, and NaN for all but the force",
            "the solver of this kind of surface: look at the wrench before solving",
        )


def _examine_level(inspection: Inspection, surface: Implicit, tolerance: float) -> None:
    """The value must be negative inside, and its differences must equal the gradient."""
    rng = np.random.default_rng(3)
    size = float(np.median(surface.half_lengths))
    step = DIFFERENCE_STEP * size

    def value(point: FloatArray) -> float:
        return surface.evaluate(surface.parameters, *point.tolist())[0]

    inspection.require(
        value(np.zeros(3)) < 0.0,
        "inside",
        f"value at the centre is {value(np.zeros(3)):.3g}",
        "below 0",
        "the sign of value, or the centre, which lies inside",
    )
    for point in size * rng.normal(size=(WRENCH_COUNT // 4, 3)):
        gradient = np.array(surface.evaluate(surface.parameters, *point.tolist())[1:4])
        numeric = np.array([value(point + step * e) - value(point - step * e) for e in np.eye(3)]) / (2.0 * step)
        inspection.require(
            np.linalg.norm(gradient - numeric) <= tolerance * np.linalg.norm(numeric),
            "gradient",
            f"gradient at {point.tolist()} m is {gradient.tolist()}, differences of value give {numeric.tolist()}",
            "the gradient of value",
            "the formula of the gradient, its sign (value grows outwards), or its frame, the surface's own",
        )
