"""What a contact bears before it slips, and how that is found by touch."""

from palpate.friction.contact_load import ContactLoad, Slip
from palpate.friction.limit_surface import LimitSurface

__all__ = ["ContactLoad", "LimitSurface", "Slip"]
