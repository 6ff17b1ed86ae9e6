"""Touch clouds of surfaces known in closed form, felt row by row, and maps of them."""

import numpy as np

from palpate.mapping import SurfaceMap, TouchCloud

CENTER = np.array([0.4, -0.1, 0.05])
RADIUS = 0.04


def cloud_of(position, normal, time=None, normal_force=2.0):
    n = len(position)
    return TouchCloud(
        time=np.arange(n) * 1e-3 if time is None else time,
        position=position,
        normal=normal,
        normal_force=np.full(n, normal_force),
        tangential_force=np.cross(normal, [0.0, 0.6, 0.0]),
        spin_torque=np.linspace(-1e-3, 1e-3, n),
    )


def raster(half=0.01, row=0.002, step=1e-4):
    """Points of a meander over a square, shape (n, 2), the ends of rows not joined."""
    along = np.arange(-half, half + step / 2, step)
    rows = np.arange(-half, half + row / 2, row)
    return np.concatenate(
        [np.column_stack([along[:: (-1) ** i], np.full_like(along, y)]) for i, y in enumerate(rows)]
    )


def cap_normals(xy, radius=RADIUS):
    """Outward normals of a sphere above points of the plane through its center."""
    return np.column_stack([xy, np.sqrt(radius**2 - (xy**2).sum(axis=1))]) / radius


def sphere_cap(half=0.01, row=0.002, step=1e-4, radius=RADIUS, center=CENTER):
    normal = cap_normals(raster(half, row, step), radius)
    return cloud_of(center + radius * normal, normal)


def plane_cloud(xy, z=0.0, up=1.0):
    return cloud_of(np.column_stack([xy, np.full(len(xy), z)]), np.tile([0.0, 0.0, up], (len(xy), 1)))


def mapped(cloud, settings=None):
    made = SurfaceMap(settings)
    made.add(cloud)
    return made


def share_in_band(answer):
    """Share of the observed points of the true surface that the band around the map holds."""
    return (np.abs(answer.distance) <= answer.band())[answer.observed].mean()
