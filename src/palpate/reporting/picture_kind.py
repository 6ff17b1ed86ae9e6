"""Kinds of files in which the pictures of a report are written for a paper; light to import."""

from typing import Literal

PictureKind = Literal["pdf", "svg", "png"]
"""By the suffix of the file."""
