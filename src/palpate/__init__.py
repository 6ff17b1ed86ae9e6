"""palpate: hybrid force control with the sense of touch."""

__version__ = "0.1.0"
