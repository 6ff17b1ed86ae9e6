"""What an exporter writes is what the logs hold, bit for bit, and a sweep is one data set."""

import json
import sys

import h5py
import numpy as np
import pyarrow.parquet as pq
import pytest

from palpate.commands.log.config import LogExportConfig
from palpate.commands.log.export import run_log_export
from palpate.commands.sweep.store import RunRecord, RunStatus, record_text
from palpate.errors import InvalidValueError
from palpate.experiments.kit.config_file import config_text
from palpate.experiments.regulate.config import RegulateConfig
from palpate.exporting import exporter
from palpate.exporting.lerobot.dataset import PLACE, QUANTILES, RunningStatistics
from palpate.extras import MissingLibraryError
from palpate.open_kinds import declared_in
from palpate.runtime.data import Phase
from palpate.runtime.log import read_log
from runtime.log.log_examples import ONE_FINGER, SMALL, TWO_FINGERS_AND_A_HAND, a_run, write

FORCES = (1.0, 1.0, 2.0)
"""Of the runs of the sweep, whose lengths differ."""


def sweep_in(folder, layouts=(TWO_FINGERS_AND_A_HAND,) * 3, lengths=(300, 7, 250)):
    """Make the folder of a sweep up, with `--keep-reports`."""
    (folder / "runs").mkdir(parents=True)
    (folder / "sweep.json").write_text("{}")
    for run, (force, layout, length) in enumerate(zip(FORCES, layouts, lengths, strict=True)):
        (folder / f"reports/{run:06d}").mkdir(parents=True)
        text = config_text("regulate", RegulateConfig(force=force, seed=run))
        write(folder / f"reports/{run:06d}/a.mcap", a_run(length, layout, seed=run), {"experiment.yaml": text})
        record = RunRecord(run=run, digest="", seed=run, status=RunStatus.DONE, metrics={"force_rms_n": 0.1 * run})
        (folder / f"runs/{run:06d}.json").write_bytes(record_text(record))
    return folder


@pytest.fixture(scope="module")
def sweep(tmp_path_factory):
    return sweep_in(tmp_path_factory.mktemp("sweep"))


@pytest.fixture(scope="module")
def logs(sweep):
    return [read_log(path).channels["/period"] for path in sorted(sweep.glob("reports/*/a.mcap"))]


def exported(place, to, out):
    assert run_log_export(LogExportConfig(place, to, out)).exit_code == 0
    return out


def same_bits(found, expected):
    """Whether numbers are equal, all NaN being one: what payload they carry no format promises."""
    found, expected = (np.ascontiguousarray(each, np.float64) for each in (found, expected))
    return ((found.view(np.uint64) == expected.view(np.uint64)) | (np.isnan(found) & np.isnan(expected))).all()


def test_parquet_keeps_every_bit_and_separates_the_runs(sweep, logs, tmp_path):
    out = exported(sweep, "parquet", tmp_path / "out")
    period = pq.read_table(out / "period.parquet")
    assert same_bits(
        period["finger_1_wrench_mz_Nm"], np.concatenate([log["finger_1"]["wrench"][:, 5] for log in logs])
    )
    assert period["episode"].to_pylist() == [0] * 300 + [1] * 7 + [2] * 250
    assert set(period["command_phase"].to_pylist()) == {phase.name for phase in Phase}
    episodes = pq.read_table(out / "episodes.parquet").to_pydict()
    told = [episodes[name] for name in ("force", "seed", "force_rms_n", "status")]
    assert told == [list(FORCES), [0, 1, 2], [0.0, 0.1, 0.2], ["done"] * 3]
    assert set(pq.read_table(out / "event.parquet")["episode"].to_pylist()) == {0, 2}


def test_hdf5_keeps_every_bit_with_units_names_and_texts(sweep, logs, tmp_path):
    with h5py.File(exported(sweep, "hdf5", tmp_path) / "episodes.hdf5") as file:
        for log, group in zip(logs, file.values(), strict=True):
            period, finger = group["period"], group["period/finger_1"]
            for name in ("wrench", "reading", "centroid", "condition"):
                assert same_bits(finger[name], log["finger_1"][name])
            assert (period["sequence"][:] == log["sequence"]).all()
            assert (period["command/grip_count"][:] == log["command"]["grip_count"]).all()
            codes = h5py.check_enum_dtype(period["command/phase"].dtype)
            assert period["command/phase"][:].tolist() == [
                codes[list(Phase)[i].name] for i in log["command"]["phase"]
            ]
        assert list(finger["wrench"].attrs["unit"]) == ["N"] * 3 + ["N m"] * 3
        assert group["settings"].attrs["force"] == FORCES[-1]
        assert group["results"].attrs["force_rms_n"] == 0.2
        assert b"force: 2" in group["attachment/experiment.yaml"][()]
        assert group["event/text"][0].decode().startswith("event before period")


@pytest.fixture(scope="module")
def dataset(sweep, tmp_path_factory):
    return exported(sweep, "lerobot", tmp_path_factory.mktemp("lerobot"))


@pytest.fixture(scope="module")
def frames(dataset):
    """Columns of the frames by name, shape (n, k)."""
    table = pq.read_table(dataset / "data" / PLACE.format(chunk_index=0, file_index=0))
    return {name: np.array(table[name].to_pylist()).reshape(len(table), -1) for name in table.column_names}


def test_lerobot_frames_are_the_finite_numbers_of_the_logs(frames, logs):
    told = {f"finger_1.{name}": [log["finger_1"][name] for log in logs]
            for name in ("wrench", "reading", "centroid", "normal_force")}  # fmt: skip
    told["state"] = [
        np.column_stack(
            [*(log["arm"][name] for name in log["arm"].dtype.names[1:]), log["hand"]["joint_position"]]
        )
        for log in logs
    ]
    for name, parts in told.items():
        expected = np.concatenate(parts).reshape(557, -1)
        assert same_bits(frames[f"observation.{name}"], np.where(np.isfinite(expected), expected, 0.0)), name
    indices = {
        "finger_0.status": np.concatenate([log["finger_0"]["status"] for log in logs]),
        "frame_index": np.concatenate([np.arange(len(log)) for log in logs]),
        "index": np.arange(557),
        "task_index": np.repeat([0, 1], [307, 250]),
    }
    for name, expected in indices.items():
        np.testing.assert_array_equal(frames[name][:, 0], expected)
    np.testing.assert_allclose(frames["timestamp"], 1e-3 * frames["frame_index"], rtol=1e-6)


def test_lerobot_grips_that_are_left_as_they_were_stay_as_they_were(dataset, frames, logs):
    info = json.loads((dataset / "meta/info.json").read_text())
    place = info["features"]["action"]["names"].index("command_grip_force_0_N")
    held, expected = 0.0, []
    for row in logs[0]["command"]:
        if row["grip_count"] >= 0:
            held = np.nan_to_num(row["grip_force"][0], posinf=0.0, neginf=0.0)
        expected.append(held)
    assert same_bits(frames["action"][:300, place], expected)


def test_lerobot_finds_everything_where_its_loader_looks(dataset, sweep):
    info = json.loads((dataset / "meta/info.json").read_text())
    assert (info["codebase_version"], info["fps"], info["splits"]) == ("v3.0", 1000, {"train": "0:3"})
    assert (info["total_episodes"], info["total_frames"], info["total_tasks"]) == (3, 557, 2)
    frames = pq.read_table(dataset / info["data_path"].format(chunk_index=0, file_index=0))
    assert set(info["features"]) == set(frames.column_names)
    for name, feature in info["features"].items():
        kind, size = frames.schema.field(name).type, len(feature["names"])
        assert feature["shape"] == [size]
        assert size == 1 or size == kind.list_size
        assert feature["dtype"] == (kind if size == 1 else kind.value_type).to_pandas_dtype().__name__.rstrip("_")
    episodes = pq.read_table(dataset / "meta/episodes").to_pydict()
    ranges = [episodes[name] for name in ("dataset_from_index", "dataset_to_index", "length", "settings/force")]
    assert ranges == [[0, 300, 307], [300, 307, 557], [300, 7, 250], list(FORCES)]
    tasks = pq.read_table(dataset / "meta/tasks.parquet")
    assert tasks["task"].to_pylist() == ["palpate regulate --force 1.0", "palpate regulate"]
    assert json.loads(tasks.schema.metadata[b"pandas"])["index_columns"] == ["task"]
    stats = json.loads((dataset / "meta/stats.json").read_text())
    assert set(stats) == set(info["features"])
    assert set(stats["action"]) == {"min", "max", "mean", "std", "count", "q01", "q10", "q50", "q90", "q99"}


def test_statistics_of_pieces_are_those_of_the_whole():
    rows, running = np.random.default_rng(1).normal([1e3, 0.0], [1.0, 1e-3], (50_001, 2)), RunningStatistics(2)
    for piece in np.split(rows, [1, 700, 20_000]):
        running.take(piece)
    found = running.found
    np.testing.assert_allclose(found["mean"], rows.mean(axis=0), rtol=1e-12)
    np.testing.assert_allclose(found["std"], rows.std(axis=0), rtol=1e-9)
    assert (found["max"] == rows.max(axis=0)).all()
    for quantile in QUANTILES:  # of some 12 500 rows: a rank is off by 4 standard deviations at most
        rank = (rows <= found[f"q{100 * quantile:02.0f}"]).mean(axis=0)
        assert (np.abs(rank - quantile) < 4.0 * np.sqrt(quantile * (1.0 - quantile) / 12_500)).all()


@pytest.mark.parametrize("to", ["csv", "parquet", "lerobot"])
def test_logs_that_no_table_can_hold_together_are_refused_and_nothing_is_left(to, tmp_path):
    sweep_in(tmp_path / "sweep", (ONE_FINGER, SMALL, ONE_FINGER))
    with pytest.raises(InvalidValueError, match=r"000001.a\.mcap: .*--to hdf5"):
        exported(tmp_path / "sweep", to, tmp_path / "out")
    assert list((tmp_path / "out").iterdir()) == []
    exported(tmp_path / "sweep", "hdf5", tmp_path / "out")


def test_a_sweep_without_logs_is_refused_with_the_remedy(tmp_path):
    (tmp_path / "sweep.json").write_text("{}")
    with pytest.raises(InvalidValueError, match="--keep-reports"):
        exported(tmp_path, "csv", tmp_path)


def test_a_folder_that_is_there_is_never_replaced(dataset, sweep):
    before = (dataset / "meta/info.json").read_text()
    with pytest.raises(InvalidValueError, match="has a data already"):
        exported(sweep, "lerobot", dataset)
    assert (dataset / "meta/info.json").read_text() == before


@pytest.mark.parametrize(("to", "library", "extra"), [("hdf5", "h5py", "hdf5"), ("lerobot", "pyarrow", "parquet")])
def test_a_library_that_is_missing_is_named_with_its_extra(to, library, extra, sweep, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(MissingLibraryError, match=rf'--to {to} needs {library}.*pip install "palpate\[{extra}\]"'):
        exported(sweep, to, tmp_path)


OWN = """
from palpate.exporting.exporter import Exporter
from palpate.open_kinds import Settings

class Lengths(Exporter, Settings, frozen=True):
    def write(self, episodes, folder):
        lengths = [[len(rows.sequence) for rows in episode.rows()] for episode in episodes]
        (folder / "lengths.txt").write_text(str(lengths))
"""


def test_a_format_of_ones_own_comes_in_like_palpates_and_logs_pass_in_pieces(sweep, tmp_path, monkeypatch):
    (tmp_path / "mine.py").write_text(OWN)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(exporter, "ROWS_AT_ONCE", 100)
    seen = json.loads((exported(sweep, "mine.py:Lengths", tmp_path / "out") / "lengths.txt").read_text())
    assert [sum(each) for each in seen] == [300, 7, 250]
    assert max(max(each) for each in seen) < 300
    assert set(declared_in(exporter.Exporter.GROUP)) >= {"csv", "parquet", "hdf5", "lerobot"}
    with pytest.raises(InvalidValueError, match="to = 'parqet': did you mean parquet"):
        exported(sweep, "parqet", tmp_path)
