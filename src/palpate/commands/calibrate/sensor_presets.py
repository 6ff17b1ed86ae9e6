"""First sensor files, from data sheets."""

import datetime

from palpate.commands.calibrate.config import PresetName
from palpate.sensing.ft import Butterworth, ContactEntry, SensorFile

WRIST_POSES = "100 static poses of an ATI wrist sensor (github.com/leledeyuan00/Gravity-Compensation-F-T-sensor)"
"""Evaluated by `palpate.sensing.ft.identify_payload`: white residuals of 0.024 N and 0.57 mN m, 1.166 kg. Without
drift in the model they are 0.29 N and 1.25 mN m, and the mass 6 % more."""


def preset_sensor(preset: PresetName, serial_number: str = "unknown") -> SensorFile:
    """Return a sensor as its maker describes it."""
    measure = "measure yours: palpate calibrate tare --learn-noise"
    today = datetime.date.today().isoformat()
    if preset == "nano17":
        return SensorFile(
            model="ATI Nano17 SI-12-0.12",
            serial_number=serial_number,
            date=today,
            provenance="template: ranges from ATI's data sheet; noise is the data sheet's resolution, 1/320 N and "
            f"1/64 N mm ({measure}); sample rate and contact thresholds are palpate's choice",
            sample_rate=1000.0,
            force_range=(12.0, 12.0, 17.0),
            moment_range=(0.12, 0.12, 0.12),
            noise_force=(1 / 320, 1 / 320, 1 / 320),
            noise_moment=(1e-3 / 64, 1e-3 / 64, 1e-3 / 64),
            contact=ContactEntry(touch_force=0.05, release_force=0.025, touch_time=0.003, release_time=0.003),
        )
    return SensorFile(
        model="ATI Axia80-M20 SI-500-20",
        serial_number=serial_number,
        date=today,
        provenance="template: ranges from ATI manual 9610-05-Ethernet Axia-09, table 4.8; noise is the white "
        f"part of {WRIST_POSES}, 0.03 N and 0.6 mN m ({measure}); their zero drifted by 1.9 N in the first 50 and "
        "jumped by 0.3 N after them, so that the contact threshold is above that; sample rate and filter are "
        "palpate's choice",
        sample_rate=500.0,
        force_range=(500.0, 500.0, 900.0),
        moment_range=(20.0, 20.0, 20.0),
        noise_force=(0.03, 0.03, 0.03),
        noise_moment=(6e-4, 6e-4, 6e-4),
        filters=(Butterworth(30.0),),
        contact=ContactEntry(touch_force=2.0, release_force=1.0, touch_time=0.01, release_time=0.01),
    )
