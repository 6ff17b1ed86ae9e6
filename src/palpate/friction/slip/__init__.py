"""Slip sensed as it begins, and what it teaches about friction.

`LoadFall` for what hangs in a hand, whatever is believed of friction; `ExcitedSlip` for one contact where the
grip can ripple, and `FingerSlips` runs it per finger. `FrictionBelief` (for a hand: `LearntSurface`) learns from
slip and from holding.

Measured and left out: high-frequency content without a ripple tells about a third of the slips within 30 ms if it
is to give no false alarm, as friction need not stick and slip (8 ms of third differences; the cases of
`benchmarks/grip onset`). A load that reaches the believed limit surface shows nothing where that surface is wrong.
"""
