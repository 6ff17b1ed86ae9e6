"""Every trust study, by its name."""

from trust import calibration, contacts, friction, limit_surface, maps, mounting, payload, shapes

ESTIMATORS = (contacts, calibration, payload, mounting, friction, limit_surface, shapes, maps)
STUDIES = {each.STUDY.name: each.STUDY for each in ESTIMATORS}
