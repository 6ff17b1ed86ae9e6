"""What a calibration found, as metrics for programs: forces and moments apart, for their units differ."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.errors import FloatArray
from palpate.estimation import Verdict
from palpate.sensing.ft import (
    BiasEstimate,
    CalibrationChoice,
    CalibrationFit,
    Drift,
    IdentifiedMounting,
    IdentifiedPayload,
    SensorFile,
)


def verdict_facts(verdict: Verdict) -> dict[str, object]:
    """Return whether an estimate is to be used, and which assumptions are broken."""
    broken = [
        {"assumption": each.assumption.name.lower(), "finding": each.finding, "remedy": each.remedy}
        for each in verdict.broken
    ]
    return {"verdict": {"ok": verdict.ok, "broken": broken}}


def calibration_metrics(fit: CalibrationFit) -> dict[str, object]:
    """Return how good a calibration is."""
    return {
        "loads": fit.load_count,
        "channels": fit.map.channels,
        "condition": fit.condition,
        "load_condition": fit.load_condition,
        **_per_axis("residual_rms", fit.residual_rms),
        **_per_axis("residual_largest", fit.residual_max),
        **_per_axis("left_out_rms", fit.left_out_rms),
        "relative_sd_at_range": fit.doubt,
        "r_squared": fit.r_squared,
    }


def choice_metrics(choice: CalibrationChoice) -> dict[str, object]:
    """Return how good the proposed calibration is, and which ones it was held against."""
    models = [
        {"model": fit.model, "verdict_ok": fit.verdict.ok, **_per_axis("left_out_rms", fit.left_out_rms)}
        for fit in choice.fits
    ]
    metrics = {
        "model": choice.proposed.model,
        "reason": choice.reason,
        "models": models,
        **calibration_metrics(choice.proposed),
    }
    if choice.temperature is not None:
        metrics["temperature_c"] = choice.temperature
    if choice.drift is not None and choice.gain is not None:
        metrics |= {**_per_axis("drift", choice.drift, "_per_k"), "gain_per_k": choice.gain}
    return metrics


def payload_metrics(found: IdentifiedPayload) -> dict[str, object]:
    """Return a payload with its standard deviations."""
    bias_sd = np.sqrt(np.diag(found.bias_covariance))
    return {
        "poses": found.pose_count,
        "mass_kg": found.payload.mass,
        "mass_sd_kg": found.mass_sd,
        "mass_by_differences_kg": found.mass_by_differences,
        "mass_by_differences_sd_kg": found.mass_by_differences_sd,
        "zero_drift": str(found.zero.drift),
        "zero_jumps_before_pose": found.zero.jumps,
        "zero_span_force_n": found.zero_span_force,
        "zero_span_moment_n_m": found.zero_span_moment,
        "bad_poses": found.zero.bad,
        "worst_pose": found.worst_pose,
        "residuals_force_n": found.residuals[:, :3],
        "residuals_moment_n_m": found.residuals[:, 3:],
        "center_of_mass_m": found.payload.center_of_mass,
        "center_of_mass_sd_m": found.center_sd,
        **_per_axis("bias", (*found.bias_force, *found.bias_moment)),
        **_per_axis("bias_sd", bias_sd),
        "condition": found.condition,
        "residual_rms_force_n": found.force_rms,
        "residual_rms_moment_n_m": found.moment_rms,
        "chi2_force": found.force_chi2,
        "chi2_moment": found.moment_chi2,
    }


def mounting_metrics(found: IdentifiedMounting) -> dict[str, object]:
    """Return how a sensor is turned on its flange, and what it carries."""
    return {
        "rotation_flange_sensor": found.rotation_flange_sensor,
        "rotvec_rad": Rotation.from_matrix(found.rotation_flange_sensor).as_rotvec(),
        "rotation_sd_rad": found.rotation_sd,
        "left_over_chi2": found.left_over_chi2,
        **payload_metrics(found.payload),
    }


def bias_metrics(found: BiasEstimate, drift: Drift, sd: FloatArray, after: SensorFile) -> dict[str, object]:
    """Return a bias with its standard errors, noise and drift; the errors are the payload's, too."""
    return {
        "readings": found.reading_count,
        **_per_axis("bias", after.bias),
        **_per_axis("standard_error", sd),
        **_per_axis("noise_sd", found.sd),
        **_per_axis("drift", drift.slope, "_per_s"),
        **_per_axis("drift_half_width", drift.half_width, "_per_s"),
    }


def _per_axis(name: str, values: Sequence[float] | FloatArray, per: str = "") -> dict[str, object]:
    """Three forces and three moments of `values` (6,)."""
    return {f"{name}_force_n{per}": tuple(values[:3]), f"{name}_moment_n_m{per}": tuple(values[3:])}
