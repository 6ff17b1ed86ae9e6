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


VALUES = ("text", True, None, {"a": 1}, [[1]], -1.0, 0.0, 1e300, math.inf, -math.inf, math.nan, 5e-324, 10**30)


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


def renamed(tree, path, wrong):
    """The text with another name of one key, and the words that refuse it."""
    parent = parent_of(tree, path)
    parent[wrong] = parent.pop(path[-1])
    return yaml.safe_dump(tree, sort_keys=False), shown_path((*path[:-1], wrong))


def misspelt(rng, text, tree):
    path = rng.choice([path for path in keys(tree) if path[-1] not in ("palpate_robot", "kind")])
    key = path[-1]
    i = rng.choice([i for i in range(len(key) - 1) if key[i] != key[i + 1]])
    wrong = rng.choice(
        (key[:i] + key[i + 1 :], key[:i] + key[i] + key[i:], key[:i] + key[i + 1] + key[i] + key[i + 2 :])
    )
    damaged, place = renamed(tree, path, wrong)
    return damaged, [place, key]


def other_unit(rng, text, tree):
    units = {path: unit for path in keys(tree) for unit in OTHER_UNITS if str(path[-1]).endswith(f"_{unit}")}
    path = rng.choice(list(units))
    stem = path[-1].removesuffix(f"_{units[path]}")
    damaged, place = renamed(tree, path, rng.choice((stem, f"{stem}_{OTHER_UNITS[units[path]]}")))
    return damaged, [place, f"write {path[-1]}"]


def removed(rng, text, tree):
    path = rng.choice(list(keys(tree)))
    del parent_of(tree, path)[path[-1]]
    optional = any(shown_path(path) in (known, known.rpartition(".")[0]) for known in DEFAULTS)
    return yaml.safe_dump(tree, sort_keys=False), None if optional else [str(path[-1])]


def doubled(rng, text, tree):
    lines = text.splitlines()
    i = rng.choice([i for i, line in enumerate(lines) if ": " in line.partition("#")[0] and "- " not in line])
    return "\n".join([*lines[: i + 1], *lines[i:]]), ["a second time", f"line {i + 2}"]


def wrong_value(rng, text, tree):
    """A value of another type or out of range; the independent reading judges whether it is allowed."""
    path, value = rng.choice(list(leaves(tree)))
    new = rng.choice(VALUES)
    if isinstance(value, list) and value and rng.random() < 0.5:
        value[rng.randrange(len(value))] = new
    else:
        parent_of(tree, path)[path[-1]] = new
    return yaml.safe_dump(tree, sort_keys=False), None


def overwritten(rng, text, tree):
    """A piece of the text, sometimes to its end, replaced by a word, a line of the file or random characters."""
    noise = rng.randbytes(rng.choice((0, 0, 1, 5, 50))).decode("utf-8", "replace")
    i = rng.randrange(len(text))
    end = rng.choice((i, i + 1, i + 2, i + rng.randrange(60), len(text)))
    return text[:i] + rng.choice((rng.choice(WORDS), rng.choice(text.splitlines()), noise)) + text[end:], None


def other_value(rng, text, tree):
    """The rest of a line, behind a separator, replaced by a word, which may be an alias of the first line."""
    lines = text.splitlines()
    i = rng.randrange(len(lines))
    head, found, _ = lines[i].partition(rng.choice((": ", "[", ", ", "- ")))
    lines[i] = f"{head}{found}{rng.choice(WORDS)}" if found else lines[i]
    return "\n".join([*rng.choice(([], ["extra: &x 1"])), *lines]), None


KINDS = (misspelt, other_unit, removed, doubled, wrong_value, overwritten, other_value)


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
    numbers = [
        entry.mass,
        entry.bandwidth,
        entry.following_error_limit,
        entry.time_step,
        robot.period,
        limits.force,
    ]
    assert all(0.0 < x < math.inf for x in (*numbers, limits.speed))
    assert all(a < b for a, b in zip(limits.workspace_lower, limits.workspace_upper, strict=True))
    assert robot.fingers[0].surface.surface() is not None


@pytest.mark.slow
@pytest.mark.parametrize(("count", "seed"), [(550, 1), (10_000, 2)])
def test_damaged_robot_files_are_refused_with_a_reason_or_read_right(count, seed):
    rng, seen = random.Random(seed), set()
    for k in range(count):
        kind, original = KINDS[k % len(KINDS)], rng.choice(TEXTS)
        text, words = kind(rng, original, yaml.safe_load(original))
        try:
            robot = read_robot_file(text)
        except InvalidValueError as error:
            message = str(error)
            assert message.isprintable(), text
            assert len(message) < 2000
            assert all(word in message for word in words or ()), (message, words, text)
            seen.add((kind, "refused"))
            continue
        assert words is None, (kind.__name__, words, text)
        check_right(text, robot)
        physical(robot)
        assert read_robot_file(yaml_text(as_written(robot))) == robot, text
        seen.add((kind, "read"))
    # both must happen, or the fuzzer tries only one side
    assert seen >= {(kind, how) for kind in (removed, wrong_value, overwritten) for how in ("read", "refused")}
