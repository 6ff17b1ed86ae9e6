"""How the site of these documents is built: `make docs`, or `sphinx-build -W --keep-going docs build/docs`.

Nothing is fetched: no inventory of another project, no font, no script.
"""

import sys
from pathlib import Path

from palpate import __version__

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE / "extensions")]

from example_pages import write_pages  # noqa: E402

write_pages(HERE.parent / "examples", HERE / "examples")

project = "palpate"
author = "The palpate developers"
copyright = author
version = release = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "command_reference",
    "public_names",
]
exclude_patterns = ["extensions"]

# headings down to this level can be linked to as on a code host: friction.md#limit-surfaces
myst_heading_anchors = 4

# what `{public-names}` explains, a page each in api/; tests hold it against the packages that there are
public_modules = sorted(
    line.split("}", 1)[1].strip()
    for page in (HERE / "api").glob("*.md")
    for line in page.read_text(encoding="utf-8").splitlines()
    if line.startswith("```{public-names}")
)

# a name in backticks in a docstring becomes a link where there is something to link to
default_role = "py:obj"
nitpicky = True
# types that a signature names and nobody is meant to make; what is typed in a page must exist
nitpick_ignore_regex = [("py:(obj|class|data|exc)", r".*")]
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_custom_sections = [("Attributes", "params_style")]
napoleon_use_rtype = False
napoleon_attr_annotations = False
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_class_signature = "mixed"
python_maximum_signature_line_length = 88
python_use_unqualified_type_names = True
add_module_names = False

html_theme = "furo"
html_title = f"palpate {release}"
html_static_path = ["_static"]
html_css_files = ["palpate.css"]
html_show_sphinx = False
html_copy_source = False
html_show_sourcelink = False
pygments_style = "friendly"
pygments_dark_style = "monokai"
