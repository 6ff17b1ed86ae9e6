"""Files that appear whole or not at all."""

import io
import os

import pytest

from palpate.atomic_file import replacing
from palpate.experiments.kit.output_folder import make_folder


@pytest.mark.parametrize("unnamed", [True, False])
def test_a_file_is_replaced_when_it_is_whole_and_nothing_else_is_left(unnamed, tmp_path, monkeypatch):
    if not unnamed:
        monkeypatch.setattr(os, "O_TMPFILE", 0, raising=False)
    path = tmp_path / "a"
    for text in ("one", "two"):
        with replacing(path) as file, io.TextIOWrapper(file) as words:  # which closes the file under it
            words.write(text)
        assert path.read_text() == text
    with pytest.raises(TypeError), replacing(path) as file:
        file.write("three")
    assert path.read_text() == "two"
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_is_tried_without_touching_what_is_in_it(tmp_path):
    (tmp_path / ".writable").write_text("mine")
    (tmp_path / "link").symlink_to(tmp_path / "elsewhere")
    make_folder(tmp_path)
    assert (tmp_path / ".writable").read_text() == "mine"
    assert sorted(path.name for path in tmp_path.iterdir()) == [".writable", "link"]
