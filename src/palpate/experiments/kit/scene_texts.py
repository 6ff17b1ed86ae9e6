"""How a log keeps a scene from a file."""

from collections.abc import Mapping
from typing import TypeVar

from palpate.errors import InvalidValueError
from palpate.sim.objects.scene_file import SceneFile

SCENE_TEXT = "scene.xml"
"""Under this name a log keeps the file, as it was."""

SCENE_FILES_TEXT = "scene-files.json"
"""Under this name what it refers to: by path, in base64."""

Kind = TypeVar("Kind", bound=SceneFile)


def scene_texts(scene: SceneFile) -> dict[str, str]:
    """Return a scene as texts, by file name."""
    return {SCENE_TEXT: scene.text, SCENE_FILES_TEXT: scene.files_text()}


def scene_in(texts: Mapping[str, str], kind: type[Kind]) -> Kind:
    """Return the scene that a log has kept.

    Args:
        texts: By file name.
        kind: In which class it is wanted.

    Raises:
        InvalidValueError: It has kept none.
    """
    for name in (SCENE_TEXT, SCENE_FILES_TEXT):
        if name not in texts:
            raise InvalidValueError(f"{name!r} is missing: there are {', '.join(texts) or 'no files'}")
    return kind.kept(SCENE_TEXT, texts[SCENE_TEXT], texts[SCENE_FILES_TEXT])
