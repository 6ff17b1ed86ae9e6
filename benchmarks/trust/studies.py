"""Every trust study, by its name."""

from trust import contacts, friction, limit_surface, maps, payload, shapes

STUDIES = {each.STUDY.name: each.STUDY for each in (contacts, payload, friction, limit_surface, shapes, maps)}
