"""A browser that is none."""


class Shown:
    """Stands for the browser: takes what a player is given and ends at once."""

    url = "http://127.0.0.1:1/"
    given = None

    def __init__(self, scene, frames, speed, host, port, plans):
        Shown.given = scene, frames, plans

    def __enter__(self):
        return self

    def __exit__(self, *_):
        return None

    def play(self):
        return None
