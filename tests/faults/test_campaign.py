"""The campaign of `benchmarks/faults`: its table, and a handful of it, drawn anew with each commit."""

import random
import subprocess
from pathlib import Path

import pytest

from faults.campaign import moments, tried
from faults.kind import Domain, Kind, Workshop
from faults.table import KINDS, KNOWN

HANDFUL = {Domain.SUPERVISION: 8, Domain.INPUT: 1, Domain.PROTOCOL: 2, Domain.NETWORK: 1, Domain.PROCESS: 1}
"""Kinds of each domain: a minute."""


def drawn(seed: int) -> list[Kind]:
    chance = random.Random(seed)
    sound = [kind for kind in KINDS if kind.name not in KNOWN]
    return [
        kind
        for domain, count in HANDFUL.items()
        for kind in chance.sample([kind for kind in sound if kind.domain is domain], count)
    ]


def commits() -> int:
    """How many there are; 0 where there is no repository, as in an sdist."""
    asked = ["git", "rev-list", "--count", "HEAD"]
    counted = subprocess.run(asked, cwd=Path(__file__).parent, capture_output=True, text=True, check=False)
    return int(counted.stdout) if counted.returncode == 0 else 0


def test_there_are_as_many_kinds_as_were_asked_for_each_with_a_name_of_its_own():
    names = [kind.name for kind in KINDS]
    assert len(names) >= 120
    assert len(set(names)) == len(names)
    assert {kind.domain for kind in KINDS} == set(Domain)
    assert KNOWN.keys() <= set(names)


def test_a_seed_gives_the_same_moments_whatever_else_is_tried():
    kind = KINDS[0]
    assert moments(3, kind, 4)[:2] == moments(3, kind, 2)
    assert moments(3, kind, 2) != moments(4, kind, 2)
    assert moments(3, kind, 2) != moments(3, KINDS[1], 2)
    assert all(0.0 <= moment.share < 1.0 for moment in moments(3, kind, 100))


@pytest.mark.slow
def test_a_handful_of_kinds_ends_as_it_must():
    seed = commits()
    with Workshop() as workshop:
        found = list(tried(drawn(seed), seed, 1, workshop))
    assert len(found) == sum(HANDFUL.values())
    wrong = [f"{one.kind} (--seed {seed}): {'; '.join(one.problems)}" for one in found if not one.right]
    assert not wrong, wrong
