"""Every trust study, by its name."""

from trust import calibration, contacts, friction, limit_surface, maps, payload, shapes

ESTIMATORS = (contacts, calibration, payload, friction, limit_surface, shapes, maps)
STUDIES = {each.STUDY.name: each.STUDY for each in ESTIMATORS}
