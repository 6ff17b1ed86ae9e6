"""Kinds that are not right yet, and why: the short form in the tests leaves them out."""

UNKNOWN = "reported as not at rest, though the arm rests: nobody could measure it"
COASTS = "the arm goes on until its watchdog stops it: at 1 s and 20 mm/s it presses 40 N where the limit is 20"
MEMORY = "a traceback, of MemoryError or of a library that cannot be loaded"

KNOWN: dict[str, str] = {
    **dict.fromkeys(
        (
            "kill -9 of the arm's client process while running",
            "a crash of the arm's client process while running",
            "a hang of the arm's client process while running",
            "RTDE bytes damaged",
            "RTDE packets cut",
            "RTDE connection closed",
            "partition",
            "partition of the sensor alone",
            "all is late by 2 s",
            "delay creeps by 2 s/s",
            "nearly all datagrams lost",
            "partition of one direction",
            "the arm's connections are reset",
            "all connections are closed and refused",
        ),
        UNKNOWN,
    ),
    "partition of the arm alone": COASTS,
    "no further memory while running": MEMORY,
}
"""By name; who mends one takes its line out."""
