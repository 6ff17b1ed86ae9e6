"""The trust studies in short form: few seeds of every kind of data that `docs/trust.md` has many of."""

import pytest
from trust.studies import STUDIES

LONG = {"map", "limit surface", "irregular mesh", "superellipsoid"}
"""Studies and cases of which one run takes more than a second."""

CASES = [
    pytest.param(
        study,
        case,
        id=f"{study.name}, {case.name}",
        marks=[pytest.mark.slow] if {study.name, case.name} & LONG else [],
    )
    for study in STUDIES.values()
    for case in study.cases
]


@pytest.mark.parametrize(("study", "case"), CASES)
def test_a_result_is_honest_or_its_verdict_says_what_is_broken(study, case):
    row = study.row(case, 2)
    assert row.silent == 0.0 or not case.shown, row
    # a false alarm in every hundred is borne, so two of two are none
    assert row.honest > 0.0 or not case.holds, row
