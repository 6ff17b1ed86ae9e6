"""`palpate contact`: wrenches in, contacts out, in constant memory."""

import contextlib
import csv
import io
import json
import math
import os
import re
import shutil
import sys
import tempfile
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol, cast

import numpy as np

from palpate.atomic_file import replacing
from palpate.commands.command_result import CommandResult, ExitCode
from palpate.commands.contact.config import STANDARD_STREAM, ContactConfig
from palpate.csv_table import WRENCH_EXAMPLE, ByteSource, Columns, short, stream_csv
from palpate.errors import FloatArray, InvalidValueError
from palpate.estimation import Assumption, BrokenAssumption
from palpate.experiments.kit.checks import check_file
from palpate.kinematics.pose import rotation_from_rotvec
from palpate.sensing.contact import Contacts, ContactStatus
from palpate.sensing.ft.arrays import OTHER_MOMENT_UNIT
from palpate.sensing.solver import Surface, contacts_from_wrenches
from palpate.sensing.tip_uncertainty import TipUncertainty
from palpate.sensing.uncertainty import (
    ContactUncertainties,
    UncertaintyStatus,
    contacts_uncertainties,
    white_noise,
)
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

_MAX_ARM = 10.0
"""Longest plausible arm of moments, relative to the distance from the sensor to the tip's far end: contacts are
within one, spin adds less than another, and mN m for N m make a thousand."""

_MAX_MOMENT = 1e300
"""Bound of moments [N m] beyond any sensor; sums of three stay numbers."""

_MIN_JUDGED = 20
"""Fewest rows of a live source whose unit is judged."""

_TIP_SIZES = 1e-4, 0.5
"""Least and largest half length of a fingertip's mesh [m]: a file beyond is in another unit."""

_JSON_NUMBER = re.compile(r"-?(?:0|[1-9][0-9]*)(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?")


# --- fingertip ---------------------------------------------------------------------------------------------------


def fingertip(config: ContactConfig) -> Surface:
    """Return the fingertip that a configuration describes.

    Raises:
        InvalidValueError: If the surface cannot be built, or is too small or too large for a fingertip.
    """
    place: dict[str, FloatArray] = {
        "center": np.array(config.center),
        "rotation": np.array(rotation_from_rotvec(config.rotvec)),
    }
    if config.mesh is not None:
        mesh = load_mesh(config.mesh, config.scale or 1.0, **place)
        least, largest = _TIP_SIZES
        half = np.asarray(mesh.half_lengths)
        if not least <= half.min() <= half.max() <= largest:
            raise InvalidValueError(
                f"mesh = {config.mesh}: is {2.0 * half.max():.3g} m long and {2.0 * half.min():.3g} m thick: half "
                f"lengths must be {least:g} to {largest:g} m; for a file in millimetres give --scale 0.001"
            )
        return mesh
    a, b, c, d, *_ = (*config.sizes, math.nan, math.nan, math.nan)
    match config.fingertip:
        case "sphere":
            return Sphere(a, **place)
        case "ellipsoid":
            return Ellipsoid((a, b, c), **place)
        case "cylinder":
            return Cylinder(a, **place)
        case "plane":
            return Plane(a, **place)
        case "paraboloid":
            return Paraboloid((a, b), **place)
        case "capsule":
            return Capsule(a, b, **place)
        case "box":
            return RoundedBox((a, b, c), d, **place)
        case _:
            return Superellipsoid((a, b, c), d, **place)


def reach(config: ContactConfig, surface: Surface) -> float:
    """Return the distance from the sensor to the fingertip's far end, or its thickness if it is endless [m]."""
    if config.mesh is not None:
        size = max(half_extents(surface))
    else:
        lengths = config.sizes[:3] if config.superellipsoid else config.sizes
        size = sum(length for length in lengths if math.isfinite(length))
    return size if config.endless else size + math.hypot(*config.center)


# --- wrenches ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class WrenchBlock:
    """Rows that have arrived.

    Attributes:
        copied: Names of the columns to copy.
        texts: Fields of these columns, one tuple per row.
        wrenches: Wrenches, shape (n, 6) [N, N m]; not finite only where that is allowed.
    """

    copied: tuple[str, ...]
    texts: list[tuple[str, ...]]
    wrenches: FloatArray


def wrench_blocks(
    source: ByteSource,
    name: str,
    not_finite: Literal["refuse", "mark"] = "refuse",
    taken: Collection[str] = (),
) -> Iterator[WrenchBlock]:
    """Yield wrenches from a stream of CSV text, as many as have arrived; the first block has no rows.

    Args:
        source: The stream.
        name: Name of the stream in messages.
        not_finite: Whether rows with nan or inf are refused or pass.
        taken: Names of output columns, which no column to copy may have.

    Raises:
        InvalidValueError: If the text has no wrenches; the message names the line.
    """
    holds = f"columns by name and unit, for example {WRENCH_EXAMPLE}"
    known: tuple[list[int], FloatArray, dict[int, str]] | None = None
    for columns, rows in stream_csv(source, name, holds):
        if known is None:
            places, factors = columns.require(columns.wrench())
            known = places, factors, _copied(columns, places, taken)
        places, factors, copied = known
        numbers = [[columns.number(place, row[place], line) for place in places] for line, row in rows]
        wrenches = np.array(numbers).reshape(-1, 6) * factors
        for i, j in np.argwhere(~np.isfinite(wrenches))[:1].tolist() if not_finite == "refuse" else ():
            line, row = rows[i]
            raise InvalidValueError(
                f"{name}, line {line}: {columns.label(places[j])} = {short(row[places[j]].strip())}: must be "
                "finite; --not-finite mark lets such rows be INVALID"
            )
        texts = [tuple(row[place] for place in copied) for _, row in rows]
        yield WrenchBlock(tuple(copied.values()), texts, wrenches)


def _copied(columns: Columns, places: Sequence[int], taken: Collection[str]) -> dict[int, str]:
    """Return the columns to copy: loggers like to end each line with a comma, so one without a name is dropped."""
    copied = {i: name for i, name in enumerate(columns.names) if name and i not in places}
    names = list(copied.values())
    for name in names:
        if names.count(name) > 1:
            raise columns.wrong(f"two columns are called {short(name)}; rename one")
        if name in taken:
            raise columns.wrong(f"column {short(name)} has the name of an output column; rename it")
    return copied


class _MomentUnits:
    """Counts moments whose arm is too long; single ones are wrong readings, most of them a wrong unit."""

    def __init__(self, reach: float, *, endless: bool) -> None:
        """Create the judge of a fingertip's moments.

        Args:
            reach: Distance from the sensor to the fingertip's far end [m]; its thickness if it is endless.
            endless: Whether the fingertip is modelled without an end: a contact far out then has a long arm, but
                spin, the moment along the force, has none.
        """
        self._longest, self._endless = _MAX_ARM * reach, endless
        self._rows = self._too_long = 0

    def take(self, wrenches: FloatArray) -> None:
        """Take further rows, shape (n, 6) [N, N m].

        Raises:
            InvalidValueError: If the arm of most moments is too long, once there are enough of them.
        """
        rows = wrenches[np.isfinite(wrenches).all(axis=1) & wrenches[:, :3].any(axis=1)]
        force = np.abs(rows[:, :3]).max(axis=1, initial=0.0)
        if self._endless:
            direction = rows[:, :3] / force[:, None]
            direction /= np.linalg.norm(direction, axis=1)[:, None]
            moment = np.abs((np.clip(rows[:, 3:], -_MAX_MOMENT, _MAX_MOMENT) * direction).sum(axis=1))
        else:
            moment = np.abs(rows[:, 3:]).max(axis=1, initial=0.0)
        self._rows += len(rows)
        self._too_long += int((moment / self._longest > force).sum())
        if self._rows >= _MIN_JUDGED:
            self.judge()

    def judge(self) -> None:
        """Refuse moments in another unit.

        Raises:
            InvalidValueError: If the arm of most moments is too long for a fingertip of this size.
        """
        if 2 * self._too_long > self._rows:
            broken = BrokenAssumption(
                Assumption.PLAUSIBLE,
                f"{self._too_long} of {self._rows} moments have an arm above {self._longest:.3g} m, {_MAX_ARM:g} "
                "times as long as the fingertip reaches",
                OTHER_MOMENT_UNIT,
            )
            raise InvalidValueError(str(broken))


# --- contacts ----------------------------------------------------------------------------------------------------

_CONTACT = (
    ("centroid", "_m", "xyz"),
    ("normal", "", "xyz"),
    ("force", "_N", "xyz"),
    ("normal_force", "_N", ""),
    ("tangential_force", "_N", "xyz"),
    ("spin_torque", "_Nm", ""),
    ("condition", "", ""),
)
"""Name, unit and components of each number of a contact."""

_DEVIATIONS = tuple(each for each in _CONTACT if each[0] not in ("force", "condition"))
"""Numbers of a contact that have standard deviations."""


class _ContactText:
    """Contacts as rows of text, in SI units, every digit kept: CSV with a column per number, or JSON lines."""

    def __init__(self, form: Literal["csv", "jsonl"], *, has_deviations: bool) -> None:
        self._is_csv = form == "csv"
        quantities = [*_CONTACT]
        if has_deviations:
            quantities += [(f"{name}_sd", unit, axes) for name, unit, axes in _DEVIATIONS]
        self.names = (
            *(
                f"{name}{axis}{unit}"
                for name, unit, axes in quantities
                for axis in ([f"_{axis}" for axis in axes] if self._is_csv and axes else [""])
            ),
            *(("status", "uncertainty") if has_deviations else ("status",)),
        )

    def header(self, copied: tuple[str, ...]) -> str:
        """Return the line of column names; nothing for JSON, whose lines name their values."""
        return _csv_lines([(*copied, *self.names)]) if self._is_csv else ""

    def rows(self, block: WrenchBlock, contacts: Contacts, deviations: ContactUncertainties | None) -> str:
        """Return a block of rows; a row has no numbers where there is no contact."""
        columns = [getattr(contacts, name) + 0.0 for name, _, _ in _CONTACT]  # minus zero reads as zero
        statuses = [[ContactStatus(value).name for value in contacts.status.tolist()]]
        if deviations is not None:
            for name, _, axes in _DEVIATIONS:
                spread = getattr(deviations, name)
                variance = np.diagonal(spread, axis1=1, axis2=2) if axes else spread
                columns.append(np.sqrt(np.maximum(variance, 0.0)))
            statuses.append([UncertaintyStatus(value).name for value in deviations.status.tolist()])
        states = zip(*statuses, strict=True)
        if self._is_csv:
            numbers = np.column_stack(columns).tolist()
            return _csv_lines(
                (*text, *(repr(x) if math.isfinite(x) else "" for x in row), *status)
                for text, row, status in zip(block.texts, numbers, states, strict=True)
            )
        keys = [json.dumps(key) for key in (*block.copied, *self.names)]
        lines = []
        for i, (text, status) in enumerate(zip(block.texts, states, strict=True)):
            values = [_json_text(field) for field in text]
            values += [_json_numbers(column[i].tolist()) for column in columns]
            values += map(json.dumps, status)
            lines.append("{" + ", ".join(f"{key}: {x}" for key, x in zip(keys, values, strict=True)) + "}\n")
        return "".join(lines)


def _csv_lines(rows: Iterable[Iterable[str]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def _json_text(field: str) -> str:
    """Return a copied field: a number of JSON stays one, digit by digit; other text is a string."""
    stripped = field.strip()
    return stripped if _JSON_NUMBER.fullmatch(stripped) else json.dumps(field)


def _json_numbers(value: float | list[float]) -> str:
    if isinstance(value, list):
        return "[" + ", ".join(map(_json_numbers, value)) + "]"
    return repr(value) if math.isfinite(value) else "null"


# --- the command -------------------------------------------------------------------------------------------------


class _ByteSink(Protocol):
    def write(self, data: bytes, /) -> object: ...
    def flush(self) -> object: ...


def run_contact(config: ContactConfig) -> int:
    """Read wrenches, write contacts; returns the exit code.

    Raises:
        InvalidValueError: If the input cannot be read or is wrong; the message names the line.
        OSError: If the output cannot be written.
    """
    counts: Counter[str] = Counter()
    try:
        with _destination(config) as sink:
            _convert(config, config.format, sink, counts)
        for warning in _unexplained(counts):
            sys.stderr.write(f"Note: {warning}\n")
    except BrokenPipeError:
        # the reader of a pipe has seen enough; what Python would flush at exit has nowhere to go
        with contextlib.suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except KeyboardInterrupt:
        return ExitCode.INTERRUPTED  # how a live source is ended
    return ExitCode.DONE


def contact_result(config: ContactConfig) -> CommandResult:
    """Read wrenches; return the number of contacts of each status, and all contacts unless a file gets them.

    They wait in memory until the last line has been found right. Ctrl-C ends a live source and keeps its contacts.

    Raises:
        InvalidValueError: If the input cannot be read or is wrong; the message names the line.
        OSError: If the output cannot be written.
    """
    counts: Counter[str] = Counter()
    rows = io.BytesIO()
    code = ExitCode.DONE
    to_file = config.out != STANDARD_STREAM
    try:
        if to_file:
            with _destination(config) as sink:
                _convert(config, config.format, sink, counts)
        else:
            _convert(config, "jsonl", rows, counts)
    except KeyboardInterrupt:
        code = ExitCode.INTERRUPTED
    return CommandResult(
        code,
        metrics={"wrenches": counts.total(), **{f"status_{name.lower()}": n for name, n in counts.items()}},
        facts={} if to_file else {"contacts": [json.loads(line) for line in rows.getvalue().splitlines()]},
        files=(config.out,) if to_file and (code is ExitCode.DONE or config.source == STANDARD_STREAM) else (),
        warnings=_unexplained(counts),
    )


def _unexplained(counts: Mapping[str, int]) -> tuple[str, ...]:
    """Return the likely mistake if no contact explains most wrenches with force."""
    without = counts.get(ContactStatus.NO_CONTACT.name, 0)
    silent = (ContactStatus.NO_FORCE.name, ContactStatus.INVALID.name)
    forceful = sum(n for name, n in counts.items() if name not in silent)
    if 2 * without <= forceful:
        return ()
    return (
        f"{without} of {forceful} rows with force: no contact explains the wrench; are moments in N m (header "
        "mx_mNm for mNm), and is the wrench what the object exerts on the finger?",
    )


def _convert(
    config: ContactConfig, form: Literal["csv", "jsonl"], sink: _ByteSink, counts: "Counter[str]"
) -> None:
    surface = fingertip(config)
    noise, tip = white_noise(config.force_noise, config.moment_noise), TipUncertainty.independent(*config.tip_sd)
    units = _MomentUnits(reach(config, surface), endless=config.endless)
    writer = _ContactText(form, has_deviations=config.has_deviations)
    name = "standard input" if config.source == STANDARD_STREAM else str(config.source)
    text = ""
    with _opened(config) as source:
        for block in wrench_blocks(source, name, config.not_finite, writer.names):
            if not block.texts:
                text = writer.header(block.copied)
                continue
            units.take(block.wrenches)
            contacts = contacts_from_wrenches(surface, block.wrenches, config.model)
            deviations = contacts_uncertainties(surface, contacts, noise, tip) if config.has_deviations else None
            sink.write((text + writer.rows(block, contacts, deviations)).encode())
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
    """Yield the sink of the contacts.

    A file appears whole or not at all; if Ctrl-C ends a live source, the file has all contacts until then.
    Standard output gets all or nothing, too, if the input is a file: rows wait in a temporary file until the last
    line has been found right. From standard input, which may be live, rows pass at once.
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
                ended = interruption  # how a live source is ended: its contacts are kept
        if ended is not None:
            raise ended
        return
    if config.source == STANDARD_STREAM:
        yield sys.stdout.buffer
        return
    with tempfile.TemporaryFile() as waiting:
        yield waiting
        waiting.seek(0)
        shutil.copyfileobj(waiting, sys.stdout.buffer)
        sys.stdout.buffer.flush()
