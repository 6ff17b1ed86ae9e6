"""Whether an sdist and a wheel hold what they should and nothing else: run by `make build`, before they are tried.

    python tests/install/built.py dist

The sdist must hold every file of the checkout that git does not ignore, except continuous integration's and the
links; the wheel, which was made from it, every file of the package and its folders.
"""

import re
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDERS = ("controllers", "hw", "sim")
LINKS = tuple(f"src/palpate/{folder}" for folder in FOLDERS)


def names_in_checkout(root: Path) -> set[str]:
    """Every file that git has or would take, but for what a user of the sdist cannot use."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=root, check=True, stdout=subprocess.PIPE, text=True).stdout.split("\0")
    left_out = (".ci/", ".github/")
    return {x for x in listed if x and not x.startswith(left_out) and x not in LINKS and (root / x).exists()}


def name_in_wheel(name: str) -> str | None:
    """Where a file of the sdist stands in the wheel; None for one that is not part of the package."""
    if name.startswith("src/palpate/"):
        return name.removeprefix("src/")
    return f"palpate/{name}" if name.startswith(tuple(f"{folder}/" for folder in FOLDERS)) else None


def refuse_difference(what: str, got: set[str], wanted: set[str]) -> None:
    """End with a message if two sets of names differ."""
    if got != wanted:
        sys.exit(f"{what} lacks {sorted(wanted - got)} and holds {sorted(got - wanted)} for nothing")


def refuse_traces(what: str, contents: dict[str, bytes]) -> None:
    """End with a message if a file names the folder that it was built in."""
    # where an absolute path begins: a checkout in /src must not find itself in ../src
    path = re.compile(rb"(?<![\w./-])" + re.escape(str(ROOT).encode()) + rb"\b")
    if traces := sorted(name for name, content in contents.items() if path.search(content)):
        sys.exit(f"{what} holds the path {ROOT}, in {traces}")


def main(folder: Path) -> None:
    """Check the one sdist and the one wheel of a folder."""
    (sdist,), (wheel,) = folder.glob("*.tar.gz"), folder.glob("*.whl")
    with tarfile.open(sdist) as archive:
        members = archive.getmembers()
        if odd := [member.name for member in members if not (member.isfile() or member.isdir())]:
            sys.exit(f"{sdist.name} holds links or devices: {odd}")
        top = f"{sdist.name.removesuffix('.tar.gz')}/"
        files = [member for member in members if member.isfile()]
        source = {x.name.removeprefix(top): stream.read() for x in files if (stream := archive.extractfile(x))}
    if (ROOT / ".git").exists():
        refuse_difference(sdist.name, set(source), names_in_checkout(ROOT) | {"PKG-INFO"})
    refuse_traces(sdist.name, source)
    with zipfile.ZipFile(wheel) as archive:
        built = {name: archive.read(name) for name in archive.namelist() if ".dist-info/" not in name}
    wanted = {place: content for name, content in source.items() if (place := name_in_wheel(name))}
    refuse_difference(wheel.name, set(built), set(wanted))
    if changed := sorted(name for name in built if built[name] != wanted[name]):
        sys.exit(f"{wheel.name} differs from {sdist.name} in {changed}")
    print(f"{sdist.name}: {len(source)} files; {wheel.name}: {len(built)} files; none missing, none for nothing")


main(Path(sys.argv[1]))
