"""Force/torque sensors: calibration, payload, bias."""
