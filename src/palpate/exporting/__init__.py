"""Logs as data sets of other programs: one run or many in, files out."""
