"""Writes examples/notebook.ipynb, for Jupyter and Colab, from the cells of examples/notebook.py.

python docs/make_notebook.py
"""

import json
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[1] / "examples" / "notebook.py"

INSTALL = """# on Colab, or wherever palpate is not yet: choose the wheel that `make build` has left in dist
import importlib.util

if importlib.util.find_spec("palpate") is None:
    from google.colab import files

    wheel = next(iter(files.upload()))
    %pip install --quiet {wheel}"""
"""First cell."""


def notebook(script: str) -> str:
    """Return the notebook whose code cells begin at each `# %%` of a script, its docstring as the first text."""
    head, *cells = script.split("\n# %%")
    docstring = head.split('"""')[1].strip()
    code = [cell.split("\n", 1) for cell in cells]
    made = [
        _cell("markdown", f"# palpate in a notebook\n\n{_without_first_line(docstring)}"),
        _cell("code", INSTALL),
    ]
    for title, body in code:
        if title.strip():
            made.append(_cell("markdown", title.strip()))
        made.append(_cell("code", body.strip()))
    about = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
    document = {"cells": made, "metadata": about, "nbformat": 4, "nbformat_minor": 5}
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"


def _without_first_line(text: str) -> str:
    return text.partition("\n")[2].strip()


def _cell(kind: str, text: str) -> dict[str, object]:
    number = sum(map(ord, text)) % 10**8  # the same text, the same cell
    cell: dict[str, object] = {"cell_type": kind, "id": f"cell-{number}", "metadata": {}}
    if kind == "code":
        cell |= {"execution_count": None, "outputs": []}
    return cell | {"source": text.splitlines(keepends=True)}


if __name__ == "__main__":
    SCRIPT.with_suffix(".ipynb").write_text(notebook(SCRIPT.read_text("utf-8")), "utf-8")
