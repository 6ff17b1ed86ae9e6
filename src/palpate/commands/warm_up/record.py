"""What `palpate warm-up` leaves behind, so that it sees another time that everything is compiled."""

import hashlib
import json
import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from llvmlite import binding

import palpate
from palpate.atomic_file import replacing
from palpate.experiments.kit.versions import versions_text
from palpate.grasp.solvers.compiled import Compiled, cache_folder

KERNELS = ("*.nbi", "*.nbc")
SOLVERS = ("*.so",)


@dataclass(frozen=True, slots=True)
class WarmUpRecord:
    """A file beside what is compiled.

    Attributes:
        path: Of the file; another for each place of palpate and of kernels.
        made_of: Hash of all that compiled code depends on.
    """

    path: Path
    made_of: str

    @classmethod
    def here(cls) -> Self:
        """Return that of this palpate on this machine."""
        package = Path(palpate.__file__).parent
        place = f"{package}\n{os.environ.get('NUMBA_CACHE_DIR', '')}"
        machine = f"{versions_text()}{binding.get_host_cpu_name()}\n{Compiled().compiler}\n"
        hashed = hashlib.sha256(machine.encode())
        for folder, folders, files in os.walk(package, followlinks=True):
            folders.sort()
            for name in sorted(files):
                if name.endswith(".py"):
                    hashed.update((Path(folder) / name).read_bytes())
        name = hashlib.sha256(place.encode()).hexdigest()[:16]
        return cls(cache_folder().parent / f"warm-up-{name}.json", hashed.hexdigest())

    def read(self) -> dict[str, Any] | None:
        """Return what was reported when everything was compiled; None if it is not, or no longer."""
        try:
            found: dict[str, Any] = json.loads(self.path.read_text(encoding="utf-8"))
            kept = found["made_of"] == self.made_of and all(map(os.path.isfile, found["files"]))
            return found if kept else None
        except (OSError, ValueError, KeyError, TypeError):
            return None

    def write(self, report: dict[str, Any]) -> None:
        """Keep what was reported, if a file can be written."""
        folders = [(Path(folder), KERNELS) for folder in report["folders"]] + [(Path(report["solvers"]), SOLVERS)]
        files = [str(file) for folder, kinds in folders for kind in kinds for file in folder.glob(kind)]
        with suppress(OSError), replacing(self.path) as file:
            file.write(json.dumps(report | {"made_of": self.made_of, "files": files}).encode())
