"""`palpate contact`: wrenches in, contacts out, in constant memory."""

import contextlib
import io
import json
import math
import os
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import BinaryIO, Protocol, cast

import numpy as np

from palpate.atomic_file import replacing
from palpate.commands.command_result import CommandResult, ExitCode
from palpate.commands.contact.config import FINGERTIPS, STANDARD_STREAM, ContactConfig
from palpate.commands.contact.table import ContactTable, JsonLines
from palpate.commands.wrench_csv import ByteSource, WrenchReader
from palpate.errors import FloatArray, InvalidValueError
from palpate.estimation import Assumption, BrokenAssumption
from palpate.experiments.kit.checks import check_file
from palpate.sensing.contact import ContactStatus
from palpate.sensing.ft.arrays import OTHER_MOMENT_UNIT
from palpate.sensing.solver import Surface, contacts_from_wrenches
from palpate.sensing.tip_uncertainty import TipUncertainty
from palpate.sensing.uncertainty import contacts_uncertainties, white_noise
from palpate.surfaces import (
    Capsule,
    Cylinder,
    Ellipsoid,
    Paraboloid,
    Plane,
    RoundedBox,
    Sphere,
    Superellipsoid,
    load_mesh,
)
from palpate.surfaces.parallel import half_extents

ARM = 10.0
"""Distances from the sensor to the far end of the tip, above which the arm of moments is in another unit: contacts
are within one, spin adds less than another, and mN m for N m make a thousand."""

HUGE = 1e300
"""[N m]. Beyond any sensor; sums of three stay numbers."""

FEWEST = 20
"""Rows of a live source before it is judged."""


class MomentUnits:
    """Counts moments whose arm is too long; single ones are wrong readings, most of them a wrong unit."""

    def __init__(self, reach: float, *, endless: bool) -> None:
        """Take the fingertip.

        Args:
            reach: Distance from the sensor to its far end [m]; its thickness if it is endless.
            endless: Whether it is modelled without an end: a contact far out then has a long arm, but spin, the
                moment along the force, has none.
        """
        self._longest, self._endless = ARM * reach, endless
        self._rows = self._too_long = 0

    def take(self, wrenches: FloatArray) -> None:
        """Take further rows, shape (n, 6) [N, N m].

        Raises:
            InvalidValueError: As `judge`, once there are enough of them.
        """
        rows = wrenches[np.isfinite(wrenches).all(axis=1) & wrenches[:, :3].any(axis=1)]
        force = np.abs(rows[:, :3]).max(axis=1, initial=0.0)
        if self._endless:
            direction = rows[:, :3] / force[:, None]
            direction /= np.linalg.norm(direction, axis=1)[:, None]
            moment = np.abs((np.clip(rows[:, 3:], -HUGE, HUGE) * direction).sum(axis=1))
        else:
            moment = np.abs(rows[:, 3:]).max(axis=1, initial=0.0)
        self._rows += len(rows)
        self._too_long += int((moment / self._longest > force).sum())
        if self._rows >= FEWEST:
            self.judge()

    def judge(self) -> None:
        """Do nothing if most moments that were taken are those of a fingertip of this size.

        Raises:
            InvalidValueError: The arm of most is too long.
        """
        if 2 * self._too_long > self._rows:
            broken = BrokenAssumption(
                Assumption.PLAUSIBLE,
                f"{self._too_long} of {self._rows} moments have an arm above {self._longest:.3g} m, {ARM:g} "
                "times as long as the fingertip reaches",
                OTHER_MOMENT_UNIT,
            )
            raise InvalidValueError(str(broken))


class _ByteSink(Protocol):
    def write(self, data: bytes, /) -> object: ...
    def flush(self) -> object: ...


def run_contact(config: ContactConfig) -> int:
    """Read wrenches, write contacts; returns the exit code.

    Raises:
        InvalidValueError: The input cannot be read or is wrong; the message names the line.
        OSError: The output cannot be written.
    """
    counts: Counter[str] = Counter()
    try:
        with _destination(config) as sink:
            _carry_out(config, ContactTable if config.format == "csv" else JsonLines, sink, counts)
        for warning in unexplained(counts):
            sys.stderr.write(f"Note: {warning}\n")
    except BrokenPipeError:
        # the reader of a pipe has seen enough; what Python would flush at exit has nowhere to go
        with contextlib.suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except KeyboardInterrupt:
        return ExitCode.INTERRUPTED  # how a live source is ended
    return ExitCode.DONE


def contact_result(config: ContactConfig) -> CommandResult:
    """Read wrenches; return how many contacts of each status there are, and all of them unless a file gets them.

    They wait in memory until the last one has been found right; a Ctrl-C ends a live source, with what there was.

    Raises:
        InvalidValueError: The input cannot be read or is wrong; the message names the line.
        OSError: The output cannot be written.
    """
    counts: Counter[str] = Counter()
    rows = io.BytesIO()
    code = ExitCode.DONE
    try:
        if config.out == STANDARD_STREAM:
            _carry_out(config, JsonLines, rows, counts)
        else:
            with _destination(config) as sink:
                _carry_out(config, ContactTable if config.format == "csv" else JsonLines, sink, counts)
    except KeyboardInterrupt:
        code = ExitCode.INTERRUPTED
    metrics = {"wrenches": counts.total(), **{f"status_{name.lower()}": n for name, n in counts.items()}}
    if config.out != STANDARD_STREAM:
        files = (config.out,) if code is ExitCode.DONE or config.source == STANDARD_STREAM else ()
        return CommandResult(code, metrics=metrics, files=files, warnings=unexplained(counts))
    found = [json.loads(line) for line in rows.getvalue().splitlines()]
    return CommandResult(code, metrics=metrics, facts={"contacts": found}, warnings=unexplained(counts))


def unexplained(counts: Mapping[str, int]) -> tuple[str, ...]:
    """Return what people may have mixed up if no contact explains most wrenches; nothing otherwise.

    Args:
        counts: Of each status, how many wrenches have it. Those without force or not finite do not count.
    """
    without = counts.get(ContactStatus.NO_CONTACT.name, 0)
    silent = (ContactStatus.NO_FORCE.name, ContactStatus.INVALID.name)
    telling = sum(n for name, n in counts.items() if name not in silent)
    if 2 * without <= telling:
        return ()
    return (
        f"{without} of {telling} rows with force: no contact explains the wrench; are moments in N m (header "
        "mx_mNm for mNm), and is the wrench what the object exerts on the finger?",
    )


def _carry_out(
    config: ContactConfig, form: type[ContactTable] | type[JsonLines], sink: _ByteSink, counts: "Counter[str]"
) -> None:
    surface = fingertip(config)
    with _opened(config) as source:
        name = "standard input" if config.source == STANDARD_STREAM else str(config.source)
        reader = WrenchReader(source, name, config.not_finite, taken=form.own_names(config.has_deviations))
        _convert(config, surface, reader, form, sink, counts)


def fingertip(config: ContactConfig) -> Surface:
    """Return the fingertip that a configuration describes.

    Raises:
        InvalidValueError: The surface cannot be built.
    """
    center, rotation = np.array(config.center), rotation_matrix_from_rotvec(np.array(config.rotvec))
    if config.mesh is not None:
        return load_mesh(config.mesh, center=center, rotation=rotation)
    if config.box is not None:
        return RoundedBox(config.box[:3], config.box[3], center, rotation)
    if config.capsule is not None:
        return Capsule(*config.capsule, center, rotation)
    if config.superellipsoid is not None:
        axes, exponent = config.superellipsoid[:3], config.superellipsoid[3]
        return Superellipsoid(axes, exponent, center=center, rotation=rotation)
    if config.sphere is not None:
        return Sphere(config.sphere, center=center, rotation=rotation)
    if config.ellipsoid is not None:
        return Ellipsoid(config.ellipsoid, center=center, rotation=rotation)
    if config.cylinder is not None:
        return Cylinder(config.cylinder, center=center, rotation=rotation)
    if config.paraboloid is not None:
        return Paraboloid(config.paraboloid, center=center, rotation=rotation)
    assert config.plane is not None  # ContactConfig has made sure that one is given
    return Plane(config.plane, center=center, rotation=rotation)


def reach(config: ContactConfig, surface: Surface) -> float:
    """Return how far from the sensor the fingertip ends, or how thick it is if it is endless [m]."""
    if config.mesh is not None:
        size = max(half_extents(surface))
    else:
        lengths = next(value for name in FINGERTIPS if (value := getattr(config, name)) is not None)
        lengths = lengths[:3] if config.superellipsoid else lengths
        size = sum(x for x in np.atleast_1d(lengths).tolist() if math.isfinite(x))
    return size if config.endless else size + math.hypot(*config.center)


def rotation_matrix_from_rotvec(rotvec: FloatArray) -> FloatArray:
    """Return the rotation about `rotvec` by |rotvec| [rad] (Rodrigues), shape (3, 3)."""
    angle = float(np.linalg.norm(rotvec))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = (rotvec / angle).tolist()
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K)


def _convert(
    config: ContactConfig,
    surface: Surface,
    reader: WrenchReader,
    form: type[ContactTable] | type[JsonLines],
    sink: _ByteSink,
    counts: "Counter[str]",
) -> None:
    noise = white_noise(config.force_noise, config.moment_noise)
    tip = TipUncertainty.independent(config.size_sd, config.position_sd, config.rotation_sd)
    units = MomentUnits(reach(config, surface), endless=config.endless)
    table: ContactTable | JsonLines | None = None
    text = ""
    for header, rows in reader.blocks():
        if table is None:
            table = form(header.names, config.has_deviations)
            text = table.header()
        if rows:
            wrenches = np.array([row.wrench for row in rows])
            units.take(wrenches)
            contacts = contacts_from_wrenches(surface, wrenches, config.model)
            deviations = contacts_uncertainties(surface, contacts, noise, tip) if config.has_deviations else None
            text += table.rows([row.copied for row in rows], contacts, deviations)
            sink.write(text.encode())
            sink.flush()
            counts.update(ContactStatus(status).name for status in contacts.status.tolist())
            text = ""
    units.judge()
    sink.write(text.encode())  # a header without rows


@contextlib.contextmanager
def _opened(config: ContactConfig) -> Iterator[ByteSource]:
    if config.source == STANDARD_STREAM:
        yield cast(ByteSource, sys.stdin.buffer)  # a BufferedReader, which typeshed calls BinaryIO
        return
    try:
        file = config.source.open("rb")
    except OSError as error:
        raise InvalidValueError(f"cannot read {config.source}: {error.strerror}") from None
    with file:
        yield file


@contextlib.contextmanager
def _destination(config: ContactConfig) -> Iterator[_ByteSink]:
    """Yield where the contacts go.

    A file appears whole or not at all; where Ctrl-C ends a live source, that is all that has come. Standard output
    gets all or nothing, too, when the input is a file: rows wait in a temporary file until the last line has been
    found right. From standard input, which may be live, rows pass at once.
    """
    if config.out != STANDARD_STREAM:
        check_file(config.out)
        both = (config.source, config.out)
        if config.source != STANDARD_STREAM and all(each.exists() for each in both) and os.path.samefile(*both):
            raise InvalidValueError(f"out = {config.out}: is the input; give another file")
        ended: KeyboardInterrupt | None = None
        with replacing(config.out) as file:
            try:
                yield file
            except KeyboardInterrupt as interruption:
                if config.source != STANDARD_STREAM:
                    raise
                ended = interruption  # how a live source is ended: what has come is kept
        if ended is not None:
            raise ended
        return
    if config.source == STANDARD_STREAM:
        yield sys.stdout.buffer
        return
    with tempfile.TemporaryFile() as waiting:
        yield waiting
        _copy(waiting, sys.stdout.buffer)


def _copy(file: BinaryIO, sink: BinaryIO) -> None:
    file.seek(0)
    shutil.copyfileobj(file, sink)
    sink.flush()
