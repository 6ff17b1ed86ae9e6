"""`palpate calibrate mounting`: how the sensor is turned on the flange, and what it carries."""

from dataclasses import replace

import numpy as np
from rich.console import Console
from rich.text import Text
from scipy.spatial.transform import Rotation

from palpate.commands.calibrate.config import MountingConfig
from palpate.commands.calibrate.data import measured_poses, read_csv
from palpate.commands.calibrate.figures import mounting_figures
from palpate.commands.calibrate.static_poses import identified, pose_noise, zero_moved
from palpate.commands.calibrate.steps import (
    loaded,
    measured,
    named,
    not_used,
    provenance,
    refuse_overwriting,
    target,
    today,
    used,
    write,
)
from palpate.commands.calibrate.tables import mounting_table, payload_table
from palpate.commands.command_result import CommandResult
from palpate.errors import FloatArray, InvalidValueError
from palpate.estimation import BrokenAssumption, Verdict
from palpate.experiments.kit.output_folder import check_file
from palpate.sensing.ft import IdentifiedMounting, IdentifiedPayload, identify_mounting, with_payload
from palpate.sensing.ft.pose_mistakes import likely_mistake
from palpate.sensing.ft.poses import STANDARD_GRAVITY


def calibrate_mounting(config: MountingConfig, console: Console) -> CommandResult:
    """Find the rotation, print it, and put payload and bias into the sensor file."""
    sensor = loaded(config.sensor)
    check_file(target(config))
    refuse_overwriting(config.out, config.poses)
    data = read_csv(config.poses)
    rows, source = measured(data, sensor, config.channels)
    poses = measured_poses(data, config.rotation, config.up, config.gravity or STANDARD_GRAVITY)
    if poses.rotation_sensor_base is None:
        raise data.wrong_header(
            "gx, gy, gz say where gravity points in the sensor; give the flange's orientation as qw,qx,qy,qz or "
            "r00,r01,...,r22"
        )
    R, noise = poses.rotation_sensor_base, pose_noise(config, sensor)

    def identify(specific_force: FloatArray, wrench: FloatArray) -> IdentifiedMounting:
        return identify_mounting(specific_force, wrench, **noise)

    def mistake(as_read: IdentifiedPayload | None) -> tuple[BrokenAssumption, ...]:
        gravity = config.gravity or STANDARD_GRAVITY
        found = likely_mistake(
            R, rows, as_read, lambda a, w: _judged(identify(a, w)), gravity=gravity, up_base=config.up
        )
        return () if found is None else (found,)

    with named(config.poses):
        found = identified(identify, poses.specific_force, rows, lambda: mistake(None))
    if found.verdict.ok and found.payload.payload.mass == 0.0:
        raise InvalidValueError(f"{config.poses}: the mass is lost in the noise: carry something heavier")
    console.print(mounting_table(found))
    console.print(payload_table(found.payload, source))
    figures = mounting_figures(found)
    if not found.verdict.ok:
        verdict = Verdict(mistake(_judged(found))).and_also(found.verdict)
        return not_used(verdict, figures, console)
    rotvec = Rotation.from_matrix(found.rotation_flange_sensor).as_rotvec()
    console.print(
        Text(
            "For the robot file, beside the tip's position_m: tcp: {rotvec_rad: ["
            f"{', '.join(f'{x:.6f}' for x in rotvec)}]}}. "
            f"Its angle is {np.degrees(np.linalg.norm(rotvec)):.4g} degrees; hold it against the drawing."
        )
    )
    with named(config.poses):
        updated = with_payload(
            sensor,
            found.payload,
            date=today(),
            provenance=provenance(
                sensor, f"mounting, payload: {found.payload.pose_count} poses, {config.poses.name}"
            ),
        )
    files, warnings = write(target(config), updated, console)
    return used(found.verdict, figures, files, (*warnings, *zero_moved(found.payload, console)))


def _judged(found: IdentifiedMounting) -> IdentifiedPayload:
    """Return the payload with the verdict on all of it."""
    return replace(found.payload, verdict=found.verdict)
