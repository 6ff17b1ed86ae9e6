"""Kinds of files in which the figures of a report are written for a paper; light to import."""

from typing import Literal

FigureKind = Literal["pdf", "svg", "png"]
"""By the suffix of the file."""
