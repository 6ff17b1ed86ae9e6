"""The truth in the rows of a log."""

from palpate.errors import FloatArray
from palpate.runtime.log.fields import TRUTH
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.truth import TruthTable


def truth_of(codec: PeriodCodec, rows: FloatArray) -> TruthTable:
    """Return what really happened in the periods of rows (n, width); a table without columns on a robot."""
    columns = codec.heading.layout.truth
    begin = codec.columns[f"{TRUTH}.{columns[0]}"].start if columns else codec.width
    return TruthTable(columns, rows[:, begin : begin + len(columns)])
