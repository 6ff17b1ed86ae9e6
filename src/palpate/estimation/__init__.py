"""Whether an estimate can be used: assumptions of its model, tested on the data."""

from palpate.estimation.verdict import HELD, Assumption, BrokenAssumption, Verdict, ill_conditioned
from palpate.estimation.whiteness import white_in_direction, white_in_place, white_in_time

__all__ = [
    "HELD",
    "Assumption",
    "BrokenAssumption",
    "Verdict",
    "ill_conditioned",
    "white_in_direction",
    "white_in_place",
    "white_in_time",
]
