"""Write the mesh of `bottle.xml`: a bottle of our own, turned about its axis, with a waist for the hand.

    python examples/scenes/make_bottle.py

It is in millimetres, as meshes often are, and the scene scales it: 5 200 triangles, closed, counter-clockwise.
"""

import math
from pathlib import Path

AROUND = 64
"""Vertices of each ring: the polygon is within 36 um of its circle."""

PROFILE = 40
"""Rings."""

LENGTH = 180.0
"""[mm]"""


def radius(s: float) -> float:
    """Radius [mm] at a share of the length: a body of 30 with a waist of 26, and a neck of 12."""
    waist = 4.0 * math.exp(-(((s - 0.35) / 0.12) ** 2))
    shoulder = 0.5 * (1.0 + math.tanh((s - 0.78) / 0.05))
    return 30.0 - waist - 18.0 * shoulder


def main() -> None:
    """Write bottle.obj beside this script."""
    lines = ["# made by make_bottle.py, in millimetres, along x"]
    rings = [(LENGTH * (i / (PROFILE - 1) - 0.5), radius(i / (PROFILE - 1))) for i in range(PROFILE)]
    for x, r in rings:
        for j in range(AROUND):
            angle = 2.0 * math.pi * j / AROUND
            lines.append(f"v {x:.3f} {r * math.cos(angle):.3f} {r * math.sin(angle):.3f}")
    lines += [f"v {-LENGTH / 2:.3f} 0 0", f"v {LENGTH / 2:.3f} 0 0"]
    first, last = PROFILE * AROUND + 1, PROFILE * AROUND + 2
    for i in range(PROFILE - 1):
        for j in range(AROUND):
            a, b = i * AROUND + j + 1, i * AROUND + (j + 1) % AROUND + 1
            lines += [f"f {a} {b} {b + AROUND}", f"f {a} {b + AROUND} {a + AROUND}"]
    for j in range(AROUND):
        k, top = (j + 1) % AROUND, (PROFILE - 1) * AROUND + 1
        lines += [f"f {first} {k + 1} {j + 1}", f"f {last} {top + j} {top + k}"]
    Path(__file__).with_name("bottle.obj").write_text("\n".join([*lines, ""]), encoding="ascii")


if __name__ == "__main__":
    main()
