"""Harness of all benchmarks of speed against error: methods x cases x judge, timing, tables, pictures, command
line.

A family (`contact.py`, `surface_maps.py`, ...) states its methods, its cases with known truth and its judge, and
returns a `Study`. `harness.command.run` makes the table, the picture and the CSV file of it.
"""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests"))  # references and simulated touches are shared with the tests
