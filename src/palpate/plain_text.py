"""Text from outside on its way out: nothing in it steers a terminal, or is a formula to a spreadsheet."""

import re

_STEERING = re.compile("[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff]")
"""C0 and C1 control characters with ESC and CSI, ends of lines, marks of writing direction (Unicode TR 9), BOM."""

_FORMULA = re.compile(r"[=+\-@\t\r]")
"""What a cell begins with that spreadsheets compute (OWASP, CSV injection)."""

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?|[-+]?(inf|nan)", re.ASCII)


def inert(text: str) -> str:
    r"""Return a text in one line that a terminal shows as it stands: ESC as the four letters \x1b."""
    return _STEERING.sub(lambda found: ascii(found[0])[1:-1], text)


def inert_cell(text: str) -> str:
    """Return a text as a cell that a spreadsheet shows: an apostrophe before a formula, numbers as they are."""
    return f"'{text}" if _FORMULA.match(text) and not _NUMBER.fullmatch(text) else text
