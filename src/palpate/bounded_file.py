"""Files from outside: regular ones alone, up to a stated size, which is checked before there is room for it."""

import errno
import io
import math
import os
import stat
import warnings
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np
from numpy.lib import format as npy

from palpate.errors import FloatArray, InvalidValueError, shown

PathLike = str | os.PathLike[str]


_FLAGS = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
"""Without O_NONBLOCK, opening a pipe waits for whoever writes into it."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """How much of a file is read.

    Attributes:
        size: Bytes.
        lines: Of text; 0 if they are not counted.
        fields: Between commas, of text; 0 if they are not counted.
    """

    size: int
    lines: int = 0
    fields: int = 0

    def check(self, name: str, text: str) -> None:
        """Refuse text that goes beyond, before it is taken apart.

        Raises:
            InvalidValueError: It does.
        """
        lines = text.count("\n") + 1
        _refuse_beyond(name, len(text), self.size, "characters")
        if self.lines:
            _refuse_beyond(name, lines, self.lines, "lines")
        if self.fields:
            _refuse_beyond(name, text.count(",") + lines, self.fields, "fields")


def open_regular(path: PathLike) -> BinaryIO:
    """Open a file to read it, following links.

    Raises:
        OSError: It cannot be opened, or is a folder.
        InvalidValueError: It is a device, a pipe or a socket, which may have no end.
    """
    descriptor = os.open(path, _FLAGS)
    try:
        mode = os.fstat(descriptor).st_mode
        if stat.S_ISDIR(mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), os.fspath(path))
        if not stat.S_ISREG(mode):
            raise InvalidValueError(
                f"{os.fspath(path)}: is a device, a pipe or a socket: only regular files are read; write what it "
                "gives to a file first"
            )
        return os.fdopen(descriptor, "rb")
    except BaseException:
        os.close(descriptor)
        raise


def read_bytes(path: PathLike, bounds: Bounds) -> bytes:
    """Return what is in a file.

    Raises:
        OSError: It cannot be read.
        InvalidValueError: It is no regular file, or too large.
    """
    with open_regular(path) as file:
        size = os.fstat(file.fileno()).st_size
        _refuse_beyond(os.fspath(path), size, bounds.size, "bytes")
        data = bytearray()
        while part := file.read(1 << 20):  # files of /proc have no size, and others grow meanwhile
            data += part
            _refuse_beyond(os.fspath(path), len(data), bounds.size, "bytes")
    return bytes(data)


def read_text(path: PathLike, bounds: Bounds, what: str) -> str:
    """Return the text of a file, without a byte order mark.

    Args:
        path: Of it.
        bounds: Of it.
        what: It should be, for messages ("a sensor file is YAML text").

    Raises:
        OSError: It cannot be read.
        InvalidValueError: It is no regular file, too large, or no text.
    """
    data = read_bytes(path, bounds)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidValueError(f"{os.fspath(path)}: not text (byte {error.start} is no UTF-8): {what}") from None
    bounds.check(os.fspath(path), text)
    return text


def read_array(path: PathLike, bounds: Bounds) -> FloatArray:
    """Return the numbers of a .npy file as float64.

    Source: "A simple file format for NumPy arrays", numpy.lib.format, versions 1.0 to 3.0.

    Raises:
        OSError: It cannot be read.
        InvalidValueError: It is no regular file, holds no array of real numbers or one larger than its bytes, or
            would take more bytes than the bounds allow.
    """
    name, data = os.fspath(path), read_bytes(path, bounds)
    file = io.BytesIO(data)
    try:
        with warnings.catch_warnings(action="ignore"):  # of headers that Python 2 wrote
            version = npy.read_magic(file)
            header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
            shape, in_columns, dtype = header(file)
        count = math.prod(shape)
    except Exception as error:  # of a header, numpy raises what its tokenizer and parser do
        raise InvalidValueError(f"{name}: cannot be read as an array of numbers ({shown(str(error))})") from None
    if dtype.kind not in "fiub" or dtype.itemsize == 0 or min(shape, default=0) < 0:
        raise InvalidValueError(f"{name}: holds {shown(str(dtype))} of shape {shown(shape)}: must be real numbers")
    _refuse_beyond(name, 8 * count, bounds.size, "bytes as float64")
    if count * dtype.itemsize > len(data) - file.tell():
        raise InvalidValueError(
            f"{name}: claims {count} numbers, and is cut off after {len(data)} bytes; write it again"
        )
    try:
        numbers = np.frombuffer(data, dtype, count, file.tell()) if count else np.empty(0)
        with np.errstate(all="ignore"):  # extremes become infinite, which nobody takes
            return np.asarray(numbers.reshape(shape, order="F" if in_columns else "C"), np.float64)
    except ValueError as error:
        raise InvalidValueError(f"{name}: shape {shown(shape)}: cannot be ({shown(str(error))})") from None


def _refuse_beyond(name: str, count: int, most: int, what: str) -> None:
    if count > most:
        raise InvalidValueError(f"{name}: {count} {what}: at most {most} are read; is it the right file?")
