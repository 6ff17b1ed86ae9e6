"""Tests of devices on wires share a process: two at a time would starve each other."""

import pytest


def test_these_tests_are_one_group(request: pytest.FixtureRequest) -> None:
    assert request.node.get_closest_marker("wire")
    assert [mark.args for mark in request.node.iter_markers("xdist_group")] == [("wire",)]
