"""Kinds that are not always right yet, and why: the short form in the tests leaves them out."""

from collections.abc import Mapping

STARVED = "now and then at a load of 8 to 16: the emulated servos are silent for longer than the 0.6 s allowed"
PACED = "at a load of 8 to 16: it is about the timing of our own threads"

KNOWN: Mapping[str, str] = {
    **dict.fromkeys(
        (
            "wire: no. 1: RTDE closed (FIN)",
            "wire: Bota silent",
            "wire: Bota out of range",
            "wire: Bota unplugged",
            "wire: gap of 5 records",
            "wire: records swapped",
            "wire: counters begin anew",
        ),
        STARVED,
    ),
    **dict.fromkeys(("wire: no. 13: other threads stopped", "wire: no. 14: periods of whole milliseconds"), PACED),
}
"""By name; who mends one takes its line out."""
