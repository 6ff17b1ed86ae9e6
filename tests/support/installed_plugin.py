"""A stranger's package, installed beside palpate for the commands of a test."""

import shutil
import subprocess
import sys
import tomllib


def installed(plugin, tmp_path_factory):
    """Return the command as whoever has installed the package types it, in a folder of its own."""
    folder, place = tmp_path_factory.mktemp("run"), tmp_path_factory.mktemp("installed")
    project = tomllib.loads((plugin / "pyproject.toml").read_text())["project"]
    package = project["name"].replace("-", "_")
    shutil.copytree(plugin / package, place / package)
    info = place / f"{package}-{project['version']}.dist-info"  # what pip makes of a project file
    info.mkdir()
    (info / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    )
    points = ((group, *point) for group, its in project["entry-points"].items() for point in its.items())
    (info / "entry_points.txt").write_text("".join(f"[{group}]\n{name} = {at}\n" for group, name, at in points))
    environment = {"PYTHONPATH": str(place), "PATH": "", "COLUMNS": "200", "HOME": str(folder)}

    def typed(*words, fails=False, begun=False):
        command = (sys.executable, "-m", "palpate", *map(str, words))
        if begun:
            return subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True, env=environment)
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, env=environment)
        assert bool(done.returncode) is fails, done.stderr + done.stdout
        return done.stderr if fails else done.stdout

    setattr(typed, "folder", folder)  # noqa: B010
    return typed
