"""From a robot file to what moves: back end, fingers, limits, delays. Knows no experiment."""
