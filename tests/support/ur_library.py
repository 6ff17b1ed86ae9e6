"""Tests that talk through the client library of UR arms, where it exists."""

import pytest

from palpate.hw.ur.library import HAS_WHEELS, is_supported

needs_ur = pytest.mark.skipif(not is_supported(), reason=f"needs ur_rtde, which exists for {HAS_WHEELS}")
