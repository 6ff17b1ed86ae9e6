"""Whether an installed palpate works: run by `make build` in a fresh environment, outside the repository."""

import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

import palpate
from palpate import ContactStatus, Sphere, contact_from_wrench

contact = contact_from_wrench(Sphere(radius=0.01), [0.0, 0.0, -2.0, 0.0, 0.0, 0.003])
assert contact.status is ContactStatus.OK
assert abs(contact.centroid[2] - 0.01) < 1e-16
assert abs(contact.spin_torque - 0.003) < 1e-17
assert version("palpate") == palpate.__version__
assert "site-packages" in palpate.__file__, f"not the installed palpate: {palpate.__file__}"
assert (Path(palpate.__file__).parent / "py.typed").exists()

with tempfile.TemporaryDirectory() as folder:
    small = ["--width", "0.01", "--depth", "0.004", "--speed", "0.05", "--out", folder]
    command = [sys.executable, "-m", "palpate", "explore", *small]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    made = {path.name for path in Path(folder).iterdir()}
    assert made >= {"report.html", "contacts.ply", "contacts.csv", "map.ply", "map.stl", "height_map.csv"}, made
    assert any(name.endswith(".mcap") for name in made), made
print(f"palpate {palpate.__version__} works")
