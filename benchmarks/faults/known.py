"""Kinds that are not right yet, and why: the short form in the tests leaves them out."""

BELIEVED = "the sensor's reading is believed, and nothing else tells how hard the tip presses"
INWARDS = "a retreat follows what the sensor shows, which points into the object"
UNKNOWN = "reported as not at rest, though the arm rests: nobody could measure it"
COASTS = "the arm goes on until its watchdog stops it: at 1 s and 20 mm/s it presses 40 N where the limit is 20"
MEMORY = "a traceback, of MemoryError or of a library that cannot be loaded"
RECORD = "exit code 0, though the log is not there"

KNOWN: dict[str, str] = {
    **dict.fromkeys(
        (
            "the position is NaN",
            "the velocity is NaN",
            "measured speed over the limit",
            "time stands still",
            "the arm repeats its last sample",
            "a device is lost for good",
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
    **dict.fromkeys(
        (
            "the sensor: frozen",
            "the sensor: frozen, and noisy",
            "the sensor: all zeros",
            "the sensor: noise only",
            "the sensor: constant 1 N",
            "the sensor: clipped at 1 N",
            "the sensor: gain 0.01",
            "the sensor: channel 3 dead",
        ),
        BELIEVED,
    ),
    "partition of the arm alone": COASTS,
    **dict.fromkeys(
        ("the sensor: spikes of 15 N", "the sensor: random within its range", "the sensor: gain -1"), INWARDS
    ),
    **dict.fromkeys(
        (
            "the folder is deleted while running",
            "the log is cut short while running",
            "the log is deleted while running",
        ),
        RECORD,
    ),
    "no further memory while running": MEMORY,
    "600 MB of address space from the beginning": MEMORY,
}
"""By name; who mends one takes its line out."""
