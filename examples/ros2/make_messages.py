"""Write palpate_msgs/msg from the schema of palpate's logs.

python examples/ros2/make_messages.py
"""

from collections.abc import Mapping
from pathlib import Path

from palpate.runtime.log.fields import Codes
from palpate.runtime.log.schema import own_types

FOLDER = Path(__file__).parent / "palpate_msgs" / "msg"


def messages() -> Mapping[str, str]:
    """Return the text of each file by its name."""
    types = own_types(Codes())
    return {f"{name.partition('/')[2]}.msg": text for name, text in types.items()}


if __name__ == "__main__":
    for name, text in messages().items():
        (FOLDER / name).write_text(text)
