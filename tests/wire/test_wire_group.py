"""Tests of devices on wires share a process: two at a time would starve each other."""

import pytest


def test_these_tests_are_one_group(request):
    if not getattr(request.config.option, "loadgroup", False):
        pytest.skip("nothing is shared out by groups")
    assert request.node.nodeid.endswith("@wire")  # by what xdist tells groups
