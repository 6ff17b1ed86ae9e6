"""How the site of these documents is built: `make docs`, or `sphinx-build -W --keep-going docs build/docs`.

Nothing is fetched: no inventory of another project, no font, no script.
"""

import sys
from pathlib import Path

from palpate import __version__

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE / "extensions")]

import make_api  # noqa: E402
from example_pages import write_pages  # noqa: E402

make_api.write_pages()
write_pages(HERE.parent / "examples", HERE / "examples")

project = "palpate"
author = "The palpate developers"
copyright = author
version = release = __version__

extensions = ["myst_parser", "command_reference"]
exclude_patterns = ["extensions"]

# headings down to this level can be linked to as on a code host: friction.md#limit-surfaces
myst_heading_anchors = 4

html_theme = "furo"
html_title = f"palpate {release}"
html_static_path = ["_static"]
html_css_files = ["palpate.css"]
html_show_sphinx = False
html_copy_source = False
html_show_sourcelink = False
pygments_style = "friendly"
pygments_dark_style = "monokai"
