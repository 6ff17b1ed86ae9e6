"""Limit surfaces of contacts, and how they are measured by touch."""

from palpate.friction.contact_load import ContactLoad, Slip
from palpate.friction.limit_surface import LimitSurface

__all__ = ["ContactLoad", "LimitSurface", "Slip"]
