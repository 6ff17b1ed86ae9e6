"""Every trust study, by its name."""

from trust import friction, limit_surface, payload, shapes

STUDIES = {study.name: study for study in (payload.STUDY, friction.STUDY, limit_surface.STUDY, shapes.STUDY)}
