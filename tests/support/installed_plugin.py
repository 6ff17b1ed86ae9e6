"""A stranger's package, installed beside palpate for the commands of a test."""

import os
import shutil
import subprocess
import sys
import tomllib

from support import warm_process


class InstalledPlugin:
    """The command as whoever has installed the package types it, in a folder of its own."""

    def __init__(self, plugin, tmp_path_factory):
        self.folder, place = tmp_path_factory.mktemp("run"), tmp_path_factory.mktemp("installed")
        project = tomllib.loads((plugin / "pyproject.toml").read_text())["project"]
        package = project["name"].replace("-", "_")
        shutil.copytree(plugin / package, place / package)
        info = place / f"{package}-{project['version']}.dist-info"  # what pip makes of a project file
        info.mkdir()
        (info / "METADATA").write_text(
            f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
        )
        points = ((group, *point) for group, its in project["entry-points"].items() for point in its.items())
        lines = "".join(f"[{group}]\n{name} = {at}\n" for group, name, at in points)
        (info / "entry_points.txt").write_text(lines)
        beside = os.pathsep.join(filter(None, (str(place), os.environ.get("PYTHONPATH"))))
        self._environment = {"PYTHONPATH": beside, "PATH": "", "COLUMNS": "200", "HOME": str(self.folder)}

    def __call__(self, *words, fails=False):
        """Carry out a command; return what it prints, or what it refuses."""
        done = warm_process.palpate(*words, folder=self.folder, environment=self._environment)
        assert bool(done.returncode) is fails, done.stderr + done.stdout
        return done.stderr if fails else done.stdout

    def begun(self, *words):
        """Begin it; return its process."""
        command = (sys.executable, "-m", "palpate", *map(str, words))
        return subprocess.Popen(command, cwd=self.folder, stdout=subprocess.PIPE, text=True, env=self._environment)
