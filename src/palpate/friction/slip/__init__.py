"""Slip sensed as it begins, and what it teaches about friction.

`MarginCrossing` where touch has measured the limit surface, `ExcitedSlip` where friction is only guessed and the
grip can ripple; `FingerSlips` runs one of them per finger. `FrictionBelief` (for a hand: `LearntSurface`) learns
from slip and from holding.

Measured and left out: high-frequency content without a ripple tells about a third of the slips within 30 ms if it
is to give no false alarm, as friction need not stick and slip; a drop of the load tells none, for steps and
shaking drop as well (8 ms of third differences, 12 ms of maximum; the cases of benchmarks/slip.py).
"""
