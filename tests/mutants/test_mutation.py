"""Mutants are what they are called, and are found again in a tree that was edited elsewhere."""

import ast

import pytest

from mutants.mutation import changed, mutants_of

SOURCE = '''
def largest(values, least=2):
    """Return the largest value of 3."""
    # a comment, with µ in it
    total = 0.5 * sum(values)
    if len(values) < least and total:
        raise ValueError("values < 2")
    return -max(values)
'''


def made(source):
    return {
        (m.operator, m.ordinal, m.statement): changed(source, c)
        for m, c in mutants_of("x", "x.py", source).items()
    }


@pytest.mark.parametrize(
    ("operator", "before", "after"),
    [
        ("comparison", "len(values) < least", "(len(values) <= least)"),
        ("logic", "len(values) < least and total", "(len(values) < least or total)"),
        ("negated", "len(values) < least and total", "(not (len(values) < least and total))"),
        ("arithmetic", "0.5 * sum(values)", "(0.5 / sum(values))"),
        ("constant", "0.5", "0.55"),
        ("sign", "-max(values)", "(max(values))"),
        ("function", "max(values)", "min(values)"),
    ],
)
def test_each_operator_changes_one_place(operator, before, after):
    (mutated,) = [text for (name, *_), text in made(SOURCE).items() if name == operator]
    assert mutated == SOURCE.replace(before, after)
    ast.parse(mutated)


def test_messages_docstrings_defaults_and_compiled_files_have_no_mutants():
    assert len(made(SOURCE)) == 7
    assert made("from numba import njit\n" + SOURCE) == {}


def test_a_mutant_is_found_again_below_other_lines():
    other = "def other():\n    return 1 + 1\n"
    assert set(made(other + SOURCE)) == set(made(other)) | set(made(SOURCE))
