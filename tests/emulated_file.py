"""A robot file of an emulated robot that a busy machine does not hurry."""

from palpate.runtime.robot import robot_path


def unhurried_file(folder, address, scale=0.25):
    """Write the shipped `emulated-ur5e` with another address and slower time, and return its path.

    At a scale of 0.25 a busy machine's stalls of 100 ms are 25 ms of the robot's.
    """
    text = robot_path("emulated-ur5e").read_text()
    for old, new in (("address: 127.0.0.2 ", f"address: {address} "), ("time_scale: 1.0", f"time_scale: {scale}")):
        assert old in text
        text = text.replace(old, new)
    path = folder / "unhurried.yaml"
    path.write_text(text)
    return str(path)
