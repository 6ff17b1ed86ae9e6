"""Every colour in which a run is shown, in reports and in the browser, on a light ground and on a dark one.

Lines and dots keep the hues of the palette of Okabe and Ito ("Color Universal Design", 2008), which stay distinct
with colour-blind eyes; on white they are a little darker than there, on a dark ground lighter, so that everything
meets WCAG 2.2 AA: 4.5 : 1 for text, 3 : 1 for what is drawn (success criteria 1.4.3 and 1.4.11).

Pictures name these roles, and whoever draws them puts the shade in: a report that of the reader's theme, a paper
the light one. No two roles have the same shade, so that a picture on paper tells them apart as a screen does.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Colour:
    """One colour by what it stands for.

    Attributes:
        name: Of its CSS variable, without the dashes.
        light: On a light ground, #rrggbb.
        dark: On a dark ground.
    """

    name: str
    light: str
    dark: str


CARD = Colour("card", "#ffffff", "#1d2126")
"""What text and pictures stand on."""
GROUND = Colour("ground", "#f5f6f8", "#14171b")
"""Of the page, between the cards."""

INK_COLOUR = Colour("ink", "#22272e", "#e6e9ed")
"""Text, axes."""
QUIET_COLOUR = Colour("quiet", "#5f6875", "#9aa4b1")
"""Text beside other text; lines that are there for comparison."""
GRID_COLOUR = Colour("line", "#dfe3e8", "#333a43")
"""Between rows, behind plots."""

FELT = Colour("felt", "#0072b2", "#56b4e9")
"""What a sensor felt, and what was found from it."""
TRUTH = Colour("truth", "#c85200", "#ff8c3a")
"""What really is, where a simulation knows it."""
SET = Colour("set", "#007f5c", "#2fcf9d")
"""What was asked for: a set force, a wanted grip, a load to be borne."""
COMMAND = Colour("command", "#8f6400", "#e6b422")
"""What the controller commanded."""
BOUND = Colour("bound", "#8b1a3a", "#ffc2d0")
"""Limits: what must not be exceeded."""
SPIN_COLOUR = Colour("spin", "#a3377f", "#e48fc4")
"""Of two kinds of load the turning one."""
TRACK = Colour("track", "#111111", "#f4f6f8")
"""Where the fingertip went; with a rim of `CARD`, over whatever it goes."""

MAP_COLOUR = Colour("unknown", "#d9dce1", "#2f353d")
"""Behind a map: nothing is known there."""
PANE_COLOUR = Colour("pane", "#f7f8fa", "#23282f")
"""Walls of a space."""

CONE_COLOUR = Colour("cone", "#f2c879", "#b98a35")
CONE_RIM = Colour("cone-rim", "#a87014", "#e0b15c")
"""Friction cones, and tangential force."""

APPROACH = Colour("approach", "#dbe9f6", "#1f3347")
SETTLE = Colour("settle", "#fdebd0", "#3d3120")
SCAN = Colour("scan", "#e2f2e5", "#1f3427")
SEEK = Colour("seek", "#f9d9d6", "#452829")
LIFT = Colour("lift", "#e9e2f3", "#312b43")
TRAVEL = Colour("travel", "#d8f0ef", "#1c3838")
HOLD = Colour("hold", "#eeeeee", "#2a2f36")
STOP = Colour("stop", "#e8d8c4", "#4a4033")
DONE = Colour("done", "#d5d8dc", "#3b4148")
LOST = Colour("lost", "#f1948a", "#6d3530")
OTHER = Colour("other", "#f4f4f4", "#24292f")
"""Pale grounds behind plots over time: what the controller was doing."""

SIDE_BY_SIDE = (
    Colour("first", "#0072b3", "#56b4ea"),
    Colour("second", "#c85201", "#ff8c3b"),
    Colour("third", "#007f5d", "#2fcf9e"),
    Colour("fourth", "#a33780", "#e48fc5"),
    Colour("fifth", "#8f6401", "#e6b423"),
    Colour("sixth", "#22272f", "#e6e9ee"),
)
"""Runs, fingers or options side by side: the same hues, distinguished by a legend alone."""

TEXT = (INK_COLOUR, QUIET_COLOUR)
DRAWN = (FELT, TRUTH, SET, COMMAND, BOUND, SPIN_COLOUR, TRACK, CONE_RIM, *SIDE_BY_SIDE)
STAGES = (APPROACH, SETTLE, SCAN, SEEK, LIFT, TRAVEL, HOLD, STOP, DONE, LOST, OTHER)
GROUNDS = (CARD, PANE_COLOUR)
ALL = (*GROUNDS, GROUND, *TEXT, GRID_COLOUR, *DRAWN, MAP_COLOUR, CONE_COLOUR, *STAGES)
"""Every colour there is."""


def rgb(colour: Colour) -> tuple[int, int, int]:
    """Return a colour on a light ground, each part from 0 to 255."""
    red, green, blue = (int(colour.light[i : i + 2], 16) for i in (1, 3, 5))
    return red, green, blue


def css_variables() -> str:
    """Return the style sheet that defines them all, by the reader's theme."""
    light = " ".join(f"--{each.name}: {each.light};" for each in ALL)
    dark = " ".join(f"--{each.name}: {each.dark};" for each in ALL)
    return (
        f":root {{ color-scheme: light dark; {light} }}\n"
        f"@media (prefers-color-scheme: dark) {{ :root {{ {dark} }} }}"
    )
