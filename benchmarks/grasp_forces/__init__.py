"""Grasp forces, speed against error: run by `python benchmarks/grasp.py`."""

from harness import ROOT as ROOT  # adds the folder of the tests, whose hard families are used
