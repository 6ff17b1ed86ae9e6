"""The forces of a grasp in space, and how much of each contact's limit the load takes."""

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.grasp.problem.contacts import GraspContacts
from palpate.reporting.figure import Axis, Figure, Panel, Space
from palpate.reporting.marks import Bars, Dash, Rule
from palpate.reporting.solids import Arrows, Labels, Solid, Spots, Surface
from palpate.runtime.palette import (
    BOUND,
    CONE_COLOUR,
    CONE_RIM,
    FELT,
    INK_COLOUR,
    SET,
    SPIN_COLOUR,
    TRUTH,
)

LONGEST_ARROW = 0.7
"""The largest force is drawn so long, over the grasp's size."""

CONE = 0.3
"""Height of a friction cone, over the grasp's size."""

CORNERS = 40
"""Of a drawn cone."""

SEEN = 0.02
"""Share of the other below which the force or the moment of a disturbance is left out."""


def grasp_force_figure(
    grasp: GraspContacts,
    forces: FloatArray,
    load: FloatArray,
    disturbance: FloatArray | None = None,
) -> Figure:
    """Return the figure of a grasp under a load.

    Args:
        grasp: Contacts, in the object's frame.
        forces: (f_n, f_t1, f_t2, tau_n) of each on the object, shape (n, 4) [N, N, N, N m].
        load: What else acts on the object, about its origin, shape (6,) [N, N m].
        disturbance: The worst direction of a further load, shape (6,); None for none.

    Raises:
        InvalidValueError: Shapes that do not go with the grasp.
    """
    n = len(grasp)
    for name, value, shape in (
        ("forces", forces, (n, 4)),
        ("load", load, (6,)),
        ("disturbance", disturbance, (6,)),
    ):
        if value is not None and value.shape != shape:
            raise InvalidValueError(f"{name} has shape {value.shape}: must be {shape}")
    worst = ", and the worst disturbance from the middle of the contacts" if disturbance is not None else ""
    return Figure(
        title="Forces of the grasp",
        caption=(
            "In space: what contacts exert on the object inside their friction cones (drawn without spin), and "
            f"the load{worst}. Bars: how much of its limit each contact uses, together and by tangential force "
            "or spin alone; below the limit with room is good."
        ),
        panels=(_space(grasp, forces, load, disturbance), _shares(grasp, forces)),
        columns=2,
        wide=True,
    )


def limit_shares(grasp: GraspContacts, forces: FloatArray) -> FloatArray:
    """Return |(f_t, tau / e)|_p, |f_t| and |tau| / e over mu f_n, shape (n, 3); NaN where nothing presses."""
    out = np.full((len(grasp), 3), np.nan)
    for i, (surface, (f, a, b, tau)) in enumerate(zip(grasp.surfaces, forces.tolist(), strict=True)):
        if f > 0.0:
            along = float(np.hypot(a, b))
            each = ((along, tau), (along, 0.0), (0.0, tau))
            out[i] = [surface.load_ratio(f, x, abs(spin)) for x, spin in each]
    return out


def _space(grasp: GraspContacts, forces: FloatArray, load: FloatArray, disturbance: FloatArray | None) -> Space:
    places = grasp.positions
    middle = places.mean(axis=0)
    size = max(float(np.linalg.norm(places - middle, axis=1).max()), float(grasp.spin_length.max()))
    pushes = np.einsum("nij,nj->ni", grasp.frames, forces[:, :3])
    longest = max(float(np.linalg.norm(np.vstack([pushes, load[None, :3]]), axis=1).max()), 1e-300)
    along = LONGEST_ARROW * size / longest * pushes
    outwards = (places - middle) / np.maximum(np.linalg.norm(places - middle, axis=1), 1e-12)[:, None]
    names = tuple(str(i + 1) for i in range(len(grasp)))
    marks: list[Solid] = [
        # an arrow that ends at the contact: contacts push, and what is inside stays free
        Arrows(places - along, along, "contact force", FELT),
        _cones(grasp, CONE * size),
        Arrows(middle[None], LONGEST_ARROW * size / longest * load[None, :3], "load", SET),
        Spots(places, colour=INK_COLOUR),
        Labels(places - along + 0.12 * size * outwards, names),
    ]
    if disturbance is not None:
        marks += _disturbance(middle, disturbance, size)
    return Space(tuple(marks), height=400)


def _disturbance(middle: FloatArray, disturbance: FloatArray, size: float) -> list[Solid]:
    """Force, and moment about the middle of the contacts."""
    force = disturbance[:3]
    by_size = (disturbance[3:] - np.cross(middle, force)) / size
    longest = max(float(np.linalg.norm(force)), float(np.linalg.norm(by_size)), 1e-300)
    return [
        Arrows(middle[None], 0.7 * LONGEST_ARROW * size / longest * part[None], name, colour)
        for part, name, colour in ((force, "worst force", TRUTH), (by_size, "worst moment", SPIN_COLOUR))
        if np.linalg.norm(part) > SEEN * longest
    ]


def _cones(grasp: GraspContacts, height: float) -> Surface:
    """The forces that friction bears: cones with their apexes at the contacts, open along n."""
    angle = np.linspace(0.0, 2.0 * np.pi, CORNERS, endpoint=False)
    rings = np.stack([np.ones(CORNERS), np.cos(angle), np.sin(angle)], axis=1)
    vertices: list[FloatArray] = []
    triangles = []
    corner = np.arange(CORNERS)
    for place, frame, mu in zip(grasp.positions, grasp.frames, grasp.friction.tolist(), strict=True):
        apex = len(vertices) * (CORNERS + 1)
        vertices.append(np.vstack([place, place + height * (rings * [1.0, mu, mu]) @ frame.T]))
        fan = np.stack([np.zeros_like(corner), 1 + corner, 1 + (corner + 1) % CORNERS], axis=1)
        triangles.append(apex + fan)
    return Surface(
        np.concatenate(vertices), np.concatenate(triangles), "friction cone", colour=CONE_COLOUR, opacity=0.45
    )


def _shares(grasp: GraspContacts, forces: FloatArray) -> Panel:
    shares = np.nan_to_num(limit_shares(grasp, forces), posinf=0.0)
    at, n = np.arange(len(grasp), dtype=float), len(grasp)
    ticks = tuple((i + 0.15, f"{i + 1}: {f:.2f} N") for i, f in enumerate(forces[:, 0].tolist()))
    return Panel(
        (
            Bars(at, shares[:, 0], np.full(n, 0.34), "together", FELT, lying=True),
            Bars(at + 0.27, shares[:, 1], np.full(n, 0.16), "tangential force", CONE_RIM, lying=True),
            Bars(at + 0.45, shares[:, 2], np.full(n, 0.16), "spin", SPIN_COLOUR, lying=True),
            Rule(1.0, "limit", BOUND, 1.4, Dash.DASH_DOT),
        ),
        Axis("share of the limit", low=0.0, high=max(1.05, 1.05 * float(shares.max(initial=0.0)))),
        Axis("contact, and its normal force", "N", low=n - 0.3, high=-0.5, ticks=ticks),
        height=400,
    )
