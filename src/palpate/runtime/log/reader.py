"""Reading a log, whole or damaged: what comes out is what went in, or does not come out."""

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO
