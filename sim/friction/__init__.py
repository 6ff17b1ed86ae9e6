"""Friction as MuJoCo's contact law cannot show it: a plant beside it, in the same scenes."""
