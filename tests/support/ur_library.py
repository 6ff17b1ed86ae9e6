"""Mark of tests that need the client library of UR arms."""

import pytest

from palpate.hw.ur.library import HAS_WHEELS, is_supported

needs_ur = pytest.mark.skipif(not is_supported(), reason=f"needs ur_rtde, which exists for {HAS_WHEELS}")
