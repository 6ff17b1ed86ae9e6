"""Friction and stiffness that an exploration measured, at the vertices of the surface's mesh."""

import math

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.explore.explored_contacts import ScanContacts
from palpate.mapping import SurfaceMesh, SurfaceModel
from palpate.mapping.arc_bins import stretch_means, stretch_starts
from palpate.mapping.layers import VertexLayer, vertex_layer
from palpate.mapping.stiffness import local_stiffness, stiffness_layer

SLIDES = 0.5
"""Share of a scan's median speed: slower, around corners, friction may not be fully developed."""

STEADY = 1.0
"""A tip slides steadily while its speed changes by less than this part of it per second: while it speeds up or
brakes, simulated friction is not Coulomb's (MuJoCo's takes the acceleration for slip)."""

CHANGES = 0.04
"""Time over which a change of speed is looked at [s]: 1 % of noise in a velocity is 0.35 per second in it."""

SLIDING = 5e-4
"""Slower than this [m/s] a tip does not slide: half the slowest scan; a tap does not measure friction."""

THIN = 4.0
"""Friction is averaged over stretches of the rows' distance over this."""

SHORTEST_WINDOW = 4e-3
"""Shortest path length over which stiffness is estimated [m]."""

LONGEST_PAUSE = 0.1
"""Between contacts of one stretch [s]."""


def friction_on(mesh: SurfaceMesh, felt: ScanContacts, rows: float) -> VertexLayer:
    """Return tangential over normal force, from contacts that slid, averaged over short stretches.

    Args:
        mesh: Of the map.
        felt: What it was made of.
        rows: Distance of rows [m].
    """
    cloud, speed = felt.cloud, felt.speed
    if len(cloud):
        slow = speed <= max(SLIDES * float(np.median(speed)), SLIDING)
        steady = ~slow & (speed_change(cloud.time, speed) <= STEADY)
        cloud = cloud.select(steady if steady.any() else ~slow)
    slid = cloud
    ratio = np.linalg.norm(slid.tangential_force, axis=1) / slid.normal_force
    starts = stretch_starts(slid.time, slid.position, slid.normal, rows / THIN, LONGEST_PAUSE)
    position, value = (stretch_means(each, starts) for each in (slid.position, ratio))
    return vertex_layer("friction", mesh.vertices, position, value, rows)


def unknown_layer(name: str, mesh: SurfaceMesh) -> VertexLayer:
    """Return a layer that is unknown everywhere."""
    nothing = np.full(len(mesh.vertices), np.nan)
    return VertexLayer(name, nothing, nothing)


def speed_change(time: FloatArray, speed: FloatArray) -> FloatArray:
    """Return how fast a speed changes, in parts of it per second, shape (n,).

    Args:
        time: When each contact was felt, increasing, shape (n,) [s].
        speed: Of the tip, shape (n,) [m/s].
    """
    before, after = (np.interp(time + half, time, speed) for half in (-0.5 * CHANGES, 0.5 * CHANGES))
    return np.asarray(np.abs(after - before) / (CHANGES * np.maximum(speed, SLIDING)))


def stiffness_on(
    mesh: SurfaceMesh, felt: ScanContacts, model: SurfaceModel, rows: float, swing: float
) -> VertexLayer:
    """Return the stiffness of the object alone [N/m]; unknown where the force did not vary.

    Args:
        mesh: Of the map.
        felt: What it was made of.
        model: Noise of contacts, as the map has learned it.
        rows: Distance of rows, or of taps, on the surface [m].
        swing: How long the force takes to swing once [s].
    """
    cloud = felt.cloud
    # over a whole swing: drift, such as normals tilted by a sensor's cross-talk, is not mistaken for compression
    window = max(SHORTEST_WINDOW, swing * float(np.median(felt.speed)) if len(cloud) else 0.0)
    found = local_stiffness(
        cloud.time,
        felt.centroid,
        cloud.normal,
        cloud.normal_force,
        noise=model,
        window=window,
        force_noise=felt.force_noise,
        known_compliance=felt.half_compliance,
    )
    # windows overlap by halves: along the path the nearest is a quarter of one away at most
    return stiffness_layer(found, mesh.vertices, math.hypot(0.25 * window, rows))
