"""Runs of a sweep in a worker, and every bit that their logs keep of them."""

import hashlib
from dataclasses import replace
from pathlib import Path

from palpate.commands.sweep.attempt import attempt
from palpate.commands.sweep.plan import RunCase
from palpate.runtime.log import log_in, read_log


def logged(case: RunCase) -> tuple[str, dict[str, object]]:
    """Do a run into its folder; return a digest of samples, commands and truth, and its metrics."""
    assert case.folder is not None
    record = attempt(case)
    log, whole = read_log(log_in(case.folder)), hashlib.sha256()
    for part in (log.samples(), log.commands(), log.truth.rows.tolist()):
        for each in part:
            whole.update(repr(each).encode())
    return whole.hexdigest(), dict(record.metrics)


def into(case: RunCase, folder: Path) -> RunCase:
    """The same run, into another folder."""
    return replace(case, folder=folder)
