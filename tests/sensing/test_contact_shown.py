"""A notebook shows of a contact what it is, with units, and nothing of it is hidden if there is none."""

import re

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from palpate import Sphere, contact_from_wrench


@given(st.lists(st.floats(-5.0, 5.0), min_size=6, max_size=6))
def test_every_quantity_is_shown_once_with_its_unit(wrench):
    contact = contact_from_wrench(Sphere(0.008), np.array(wrench))
    html = contact._repr_html_()
    rows = re.findall(r"<tr><th>([a-z ]+)</th><td>([^<]*)</td><td>([^<]*)</td></tr>", html)
    shown = {name: (value, unit) for name, value, unit in rows}
    assert (
        html
        == "<table>" + "".join(f"<tr><th>{n}</th><td>{v}</td><td>{u}</td></tr>" for n, v, u in rows) + "</table>"
    )
    assert shown["status"] == (contact.status.name, "")
    assert {name: unit for name, (_, unit) in shown.items() if unit} == {
        "centroid": "mm", "normal force": "N", "tangential force": "N", "spin torque": "mN m",
    }  # fmt: skip
    force = float(shown["normal force"][0])
    np.testing.assert_allclose(force, contact.normal_force, rtol=1e-3)  # nan where there is no contact
    centroid = [float(entry) for entry in shown["centroid"][0].split(", ")]
    np.testing.assert_allclose(centroid, 1e3 * contact.centroid, rtol=1e-3)
