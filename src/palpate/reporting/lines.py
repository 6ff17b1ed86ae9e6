"""What was felt and what was true in one plot, neither hidden by the other."""

from palpate.errors import FloatArray
from palpate.reporting.marks import Dash, Line
from palpate.runtime.palette import FELT, TRUTH


def true_and_felt(time: FloatArray, true: FloatArray | None, felt: FloatArray) -> tuple[Line, ...]:
    """Return `felt` (n,) as a line, and `true` (n,), if known, as dots on it: where they agree both are seen."""
    line = Line(time, felt, "felt", FELT, width=1.6)
    return (line,) if true is None else (line, Line(time, true, "true", TRUTH, width=2.6, dash=Dash.DOTTED))
