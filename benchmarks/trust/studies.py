"""Every trust study, by its name."""

from trust import friction, payload

STUDIES = {study.name: study for study in (payload.STUDY, friction.STUDY)}
