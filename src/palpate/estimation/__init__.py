"""Whether an estimate can be used: assumptions of its model, tested on the data."""

from palpate.estimation.verdict import HELD, Assumption, BrokenAssumption, Verdict
from palpate.estimation.whiteness import white_in_direction, white_in_place, white_in_time

__all__ = [
    "HELD",
    "Assumption",
    "BrokenAssumption",
    "Verdict",
    "white_in_direction",
    "white_in_place",
    "white_in_time",
]
