"""Robot files of emulated robots: a shipped one with texts of it replaced."""

from palpate.robots.robot import ROBOT_TEXT, read_robot, robot_path


def changed_robot(robot, *changes, file=ROBOT_TEXT):
    """Return the robot with words of one of its files replaced, each given as old and new."""
    texts = dict(robot.texts)
    for old, new in changes:
        assert old in texts[file]
        texts[file] = texts[file].replace(old, new, 1)
    return read_robot(texts)


def changed_file(folder, name, *changes):
    """Write a shipped robot's file with texts of it replaced, each given as old and new; return its path."""
    text = robot_path(name).read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / f"{name}.yaml"
    path.write_text(text)
    return str(path)


def unhurried_file(folder, address, scale=0.25):
    """Write the shipped `emulated-ur5e` with another address and slower time, and return its path.

    At a scale of 0.25 a busy machine's stalls of 100 ms are 25 ms of the robot's.
    """
    return changed_file(
        folder,
        "emulated-ur5e",
        ("address: 127.0.0.2 ", f"address: {address} "),
        ("time_scale: 1.0", f"time_scale: {scale}"),
    )
