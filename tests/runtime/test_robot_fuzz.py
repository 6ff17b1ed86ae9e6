"""Damaged robot files: refused with place and reason, or read as an independent reader reads them."""

import math
import random

import pytest
import yaml

from palpate.errors import InvalidValueError
from palpate.open_kinds import as_written
from palpate.robots.robot import ROBOT_TEXT, load_robot
from palpate.robots.robot_file import read_robot_file
from palpate.strict_refusal import shown_path
from palpate.yaml_text import yaml_text

TEXTS = [load_robot(name).texts[ROBOT_TEXT] for name in ("stage", "stage-nano17")]
DEFAULTS = {
    "pace.kind": "simulated",
    "limits.contact_speed_m_per_s": None,
    "pace.overrun": "skip",
    "pace.spin_s": 0.0,
    "pace.priority": None,
    "fingers[0].surface.center_m": [0.0, 0.0, 0.0],
    "fingers[0].surface.rotvec_rad": [0.0, 0.0, 0.0],
    "fingers[0].payload.mass_kg": 0.0,
    "fingers[0].payload.center_of_mass_m": [0.0, 0.0, 0.0],
    "fingers[0].payload.mass_sd_kg": 0.0,
    "fingers[0].payload.center_of_mass_sd_m": [0.0, 0.0, 0.0],
    "fingers[0].payload": None,
    "fingers[0].sensor": None,
    "fingers[0].sensor_device": None,
    "fingers[0].noise": None,
    "fingers[0].simulated_sensor": None,
    "fingers[0].simulated_sensor.preset": "perfect",
    "fingers[0].simulated_sensor.specimen": 0,
    "fingers[0].simulated_sensor.tare_s": 0.0,
    **dict.fromkeys(
        f"fingers[0].simulated_sensor.{key}"
        for key in (
            "range",
            "cross_talk",
            "bandwidth",
            "bias",
            "drift",
            "quantisation",
            "saturation",
            "sample_rate_Hz",
            "latency_s",
            "lost_share",
        )
    ),
    "fingers[0].noise.force_N": 0.0,
    "fingers[0].noise.moment_Nm": 0.0,
    "limits.force_N": 20.0,
    "limits.impact_force_N": None,
    "limits.moment_Nm": 2.0,
    "limits.spin_torque_Nm": 1.0,
    "limits.grip_force_N": 20.0,
    "limits.speed_m_per_s": 0.25,
    "limits.acceleration_m_per_s2": 25.0,
    "limits.angular_speed_rad_per_s": 2.5,
    "limits.angular_acceleration_rad_per_s2": 250.0,
    "limits.sample_age_s": 0.02,
    "limits.workspace_lower_m": [-1.0, -1.0, -1.0],
    "limits.workspace_upper_m": [1.0, 1.0, 1.0],
    "limits.joint_lower_rad": [],
    "limits.joint_upper_rad": [],
}
"""What may be left out, written down here once more by hand."""
OTHER_UNITS = {"m": "mm", "kg": "g", "s": "ms", "N": "mN", "Nm": "Nmm", "rad": "deg", "m_per_s": "mm_per_s",
               "m_per_s2": "mm_per_s2", "rad_per_s": "Hz"}  # fmt: skip
# fmt: off
WORDS = (
    ".nan", "-.inf", ".inf", "1e999", "-1", "0", "1e-320", "1e300", "9" * 26, "9" * 5000, "true", "no", "null",
    "~", "", "''", "[]", "{}", "[1,2,3]", "[[[[1]]]]", "{a: 1}", "*x", "&x", "!!int", "!!python/object:os.system",
    "-", ":", "?", "|", ">", "%", "@", "`", "\t", "0x1F", "1_000", "12:30:45", "0.5 m", "1,5", "<<", '"\\ud83d"',
    '"\\x00"', "\ufeff", "\u2028", "é", "---", "...", "stage", "sphere", "[" * 500,
)
# fmt: on


def leaves(value, path=()):
    """Every value that is no mapping or list of mappings, by its path."""
    if isinstance(value, dict) and value:
        for key, item in value.items():
            yield from leaves(item, (*path, key))
    elif isinstance(value, list) and any(isinstance(item, dict) for item in value):
        for i, item in enumerate(value):
            yield from leaves(item, (*path, i))
    else:
        yield path, value


def keys(value, path=()):
    """The path of every key."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield (*path, key)
            yield from keys(item, (*path, key))
    if isinstance(value, list):
        for i, item in enumerate(value):
            yield from keys(item, (*path, i))


def parent_of(tree, path):
    for step in path[:-1]:
        tree = tree[step]
    return tree


def dumped(tree):
    return yaml.safe_dump(tree, sort_keys=False)


def fresh(rng):
    return yaml.safe_load(rng.choice(TEXTS))


def misspelt(rng):
    tree = fresh(rng)
    path = rng.choice([path for path in keys(tree) if path[-1] not in ("palpate_robot", "kind")])
    key = path[-1]
    i = rng.randrange(len(key) - 1)
    wrong = rng.choice(
        (key[:i] + key[i + 1 :], key[:i] + key[i] + key[i:], key[:i] + key[i + 1] + key[i] + key[i + 2 :])
    )
    if wrong == key:
        return misspelt(rng)
    parent = parent_of(tree, path)
    parent[wrong] = parent.pop(key)
    return dumped(tree), [shown_path((*path[:-1], wrong)), key]


def other_unit(rng):
    tree = fresh(rng)
    units = {path: unit for path in keys(tree) for unit in OTHER_UNITS if str(path[-1]).endswith(f"_{unit}")}
    path = rng.choice(list(units))
    key = path[-1]
    stem = key.removesuffix(f"_{units[path]}")
    wrong = rng.choice((stem, f"{stem}_{OTHER_UNITS[units[path]]}"))
    parent = parent_of(tree, path)
    parent[wrong] = parent.pop(key)
    return dumped(tree), [shown_path((*path[:-1], wrong)), f"write {key}"]


def removed(rng):
    tree = fresh(rng)
    path = rng.choice(list(keys(tree)))
    del parent_of(tree, path)[path[-1]]
    optional = any(shown_path(path) in (known, known.rpartition(".")[0]) for known in DEFAULTS)
    return dumped(tree), None if optional else [str(path[-1])]


def doubled(rng):
    lines = rng.choice(TEXTS).splitlines()
    i = rng.choice([i for i, line in enumerate(lines) if ": " in line.partition("#")[0] and "- " not in line])
    return "\n".join([*lines[: i + 1], lines[i], *lines[i + 1 :]]), ["a second time", f"line {i + 2}"]


def wrong_value(rng):
    """A number that is none, or that cannot be; whether it can, the independent reading judges."""
    tree = fresh(rng)
    path, value = rng.choice(list(leaves(tree)))
    choices = [
        "text",
        True,
        None,
        {"a": 1},
        [[1]],
        -1.0,
        0.0,
        1e300,
        math.inf,
        -math.inf,
        math.nan,
        5e-324,
        10**30,
    ]
    new = rng.choice(choices)
    if isinstance(value, list) and value and rng.random() < 0.5:
        value[rng.randrange(len(value))] = new
    else:
        parent_of(tree, path)[path[-1]] = new
    return dumped(tree), None


def truncated(rng):
    text = rng.choice(TEXTS)
    start = rng.randrange(len(text)) if rng.random() < 0.2 else 0
    return text[start : rng.randrange(len(text) + 1)], None


def random_bytes(rng):
    data = bytearray(rng.choice(TEXTS).encode())
    for _ in range(rng.choice((1, 1, 2, 5, 50))):
        data[rng.randrange(len(data))] = rng.randrange(256)
    return data.decode("utf-8", "replace"), None


def inserted(rng):
    text = rng.choice(TEXTS)
    i = rng.randrange(len(text))
    return text[:i] + rng.choice(WORDS) + text[i + rng.randrange(3) :], None


def swapped_values(rng):
    lines = rng.choice(TEXTS).splitlines()
    for _ in range(rng.randrange(1, 3)):
        i = rng.randrange(len(lines))
        head, found, _ = lines[i].partition(rng.choice((": ", "[", ", ", "- ")))
        if found:
            lines[i] = f"{head}{found}{rng.choice(WORDS)}"
    return "\n".join(lines), None


def swapped_lines(rng):
    lines = rng.choice(TEXTS).splitlines()
    for _ in range(rng.randrange(1, 4)):
        i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
        lines[i], lines[j] = lines[j], lines[i]
    return "\n".join(lines), None


def with_alias(rng):
    tree = fresh(rng)
    path = rng.choice([path for path, _ in leaves(tree) if path[-1] != "palpate_robot"])
    lines = dumped(tree).splitlines()
    target = next(i for i, line in enumerate(lines) if f"{path[-1]}:" in line)
    lines[target] = lines[target].partition(":")[0] + ": *one"
    return "\n".join(["extra: &one 1", *lines]), [""]


KINDS = (
    misspelt, other_unit, removed, doubled, wrong_value, truncated, random_bytes, inserted, swapped_values,
    swapped_lines, with_alias,
)  # fmt: skip


def same(written, value):
    """Whether a value is what plain text says: float() is the judge, no code of ours."""
    if isinstance(value, list):
        return isinstance(written, list) and len(written) == len(value) and all(map(same, written, value))
    if value is None:
        return written in ("", "~", "null", "Null", "NULL")
    if isinstance(value, str):
        return written == value
    return not isinstance(written, list | dict) and float(written) == value


LOADER = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
"""PyYAML's and libyaml's differ in where a tab may stand; the reader takes libyaml's where there is one."""


def check_right(text, robot):
    """Every key of the file is in the robot with its value, and the rest of the robot is default."""
    written = {shown_path(path): value for path, value in leaves(yaml.load(text, Loader=LOADER))}
    found = {shown_path(path): value for path, value in leaves(as_written(robot))}
    for path, value in written.items():
        if value in ({}, "", "~", "null", "Null", "NULL") and path not in found:  # an empty group: all default
            assert any(other.startswith(f"{path}.") or other == path for other in (*found, *DEFAULTS)), path
            continue
        assert same(value, found[path]), (path, value, found[path])
    for path, value in found.items():
        if path not in written:
            assert value == DEFAULTS[path], path


def physical(robot):
    entry, limits = robot.backend, robot.limits
    surface = robot.fingers[0].surface
    numbers = [
        entry.mass,
        entry.bandwidth,
        entry.following_error_limit,
        entry.time_step,
        robot.period,
        limits.force,
        limits.speed,
    ]
    assert all(0.0 < x < math.inf for x in numbers)
    assert all(a < b for a, b in zip(limits.workspace_lower, limits.workspace_upper, strict=True))
    assert surface.surface() is not None


def try_files(count, seed):
    """Return how many were read and how many refused, by kind of damage; anything else raises."""
    rng = random.Random(seed)
    read, refused = dict.fromkeys(KINDS, 0), dict.fromkeys(KINDS, 0)
    for k in range(count):
        kind = KINDS[k % len(KINDS)]
        text, words = kind(rng)
        try:
            robot = read_robot_file(text)
        except InvalidValueError as error:
            message = str(error)
            assert message.isprintable(), text
            assert len(message) < 2000
            for word in words or ():
                assert word in message, (message, words, text)
            refused[kind] += 1
            continue
        assert words is None, (kind.__name__, words, text)
        check_right(text, robot)
        physical(robot)
        assert read_robot_file(yaml_text(as_written(robot))) == robot, text
        read[kind] += 1
    return read, refused


@pytest.mark.slow
def test_550_damaged_robot_files_are_refused_with_a_reason_or_read_right():
    read, refused = try_files(550, 1)
    # both must happen, or the fuzzer tries only one side
    for kind in (removed, wrong_value, truncated, random_bytes, inserted):
        assert read[kind] > 0, kind.__name__
        assert refused[kind] > 0, kind.__name__


@pytest.mark.slow
def test_10000_damaged_robot_files_are_refused_with_a_reason_or_read_right():
    read, refused = try_files(10_000, 2)
    assert sum(read.values()) + sum(refused.values()) == 10_000
    assert sum(read.values()) > 500
