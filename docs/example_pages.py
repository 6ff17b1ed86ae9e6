"""The pages of the examples: each script's docstring is its page, with the script below.

`docs/conf.py` calls `write_pages` at every build. `python docs/example_pages.py` makes the pictures that pages
show, in some seconds, by running the scripts; they are kept in `docs/examples`.
"""

import ast
import os
import subprocess
import sys
import tempfile
from pathlib import Path

PICTURES = {
    "live_netft": (("--seconds", "1.5"), "live_netft.png"),
    "sweep": (("--out", "sweep"), "sweep/own.png"),
}
"""Of scripts that draw: their options, and the file that they leave."""

HERE = Path(__file__).parent


def write_pages(source: Path, target: Path) -> tuple[Path, ...]:
    """Write a page of Markdown for each script of a folder into another, which is made if need be.

    Other pages there are removed. A page that is already as it should be is not touched, so that a second build
    has nothing to do.

    Args:
        source: Folder of scripts.
        target: Folder of pages; a picture there of a script's name is shown.

    Raises:
        ValueError: A script has no docstring; the message names it.
    """
    target.mkdir(parents=True, exist_ok=True)
    pages = []
    for script in sorted(source.glob("*.py")):
        page = target / f"{script.stem}.md"
        text = page_of(script, os.path.relpath(script, target), picture=(target / f"{script.stem}.png").exists())
        if not page.exists() or page.read_text(encoding="utf-8") != text:
            page.write_text(text, encoding="utf-8")
        pages.append(page)
    for old in set(target.glob("*.md")) - set(pages):
        old.unlink()
    return tuple(pages)


def page_of(script: Path, link: str, *, picture: bool = False) -> str:
    """Return the page of a script: the docstring's first line is its title, and the code stands below.

    Args:
        script: The file.
        link: Its path as the page writes it.
        picture: Whether a picture of the script's name lies beside the page.

    Raises:
        ValueError: It has no docstring.
    """
    tree = ast.parse(script.read_text(encoding="utf-8"))
    said = ast.get_docstring(tree)
    if not said:
        raise ValueError(f"{script}: has no docstring; its first line is the page's title")
    title, _, body = said.partition("\n")
    parts = [f"# {title.rstrip('.')}", body.strip()]
    if picture:
        parts.append(f"![What it draws]({script.stem}.png)")
    first = (tree.body[0].end_lineno or 1) + 2  # past the empty line
    parts.append(f"```{{literalinclude}} {link}\n:language: python\n:lines: {first}-\n```")
    return "\n\n".join(parts) + "\n"


def make_pictures() -> None:
    """Run the scripts that draw, and keep their pictures."""
    for name, (options, file) in PICTURES.items():
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, str(HERE.parent / "examples" / f"{name}.py"), *options]
            subprocess.run(command, cwd=folder, env={**os.environ, "MPLBACKEND": "Agg"}, check=True)
            target = HERE / "examples" / f"{name}.png"
            target.parent.mkdir(exist_ok=True)
            target.write_bytes((Path(folder) / file).read_bytes())
            print(target)


if __name__ == "__main__":
    make_pictures()
