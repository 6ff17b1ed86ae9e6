"""`palpate regulate` as people type it."""

import os
import signal

import pytest

from palpate.cli import main
from palpate.experiments.kit.config_file import read_config
from palpate.experiments.regulate.config import RegulateConfig
from palpate.runtime import Command
from palpate.runtime.log import read_log


def test_the_command_leaves_its_files_and_says_where(tmp_path, capsys):
    out = tmp_path / "new"
    words = ["regulate", "--profile", "step", "--hold", "0.3", "--duration", "0.9", "--out", str(out)]
    assert main(words) == 0
    said = capsys.readouterr().out
    assert "overshoot" in said
    assert "report.html" in said
    names = {path.name for path in out.iterdir() if path.suffix != ".mcap"}
    assert names == {"report.html", "forces.csv"}
    html = (out / "report.html").read_text()
    assert "Step response" in html
    assert "http://" not in html.replace("http://www.w3.org", "")
    assert "What limits it" in html
    assert main(["replay", str(out)]) == 0
    assert "identical, bit for bit; all that was felt is the same" in capsys.readouterr().out
    assert main(["replay", str(out), "--set", "force=3"]) == 0
    assert "commanded velocity apart" in capsys.readouterr().out
    assert main(["replay", str(out), "--set", "stiffness=3"]) == 2
    assert "assumed_stiffness is what the gain is made for" in capsys.readouterr().err
    assert main(["regulate", "--surface", "missing", "--out", str(out)]) == 1


@pytest.mark.slow
def test_a_file_gives_values_and_what_is_typed_goes_before_them(tmp_path, capsys):
    out, file = tmp_path / "out", tmp_path / "mine.yaml"
    (tmp_path / "moved.csv").write_text("0,0,0,0\n0.2,0.001,0,0\n")
    file.write_text(
        f"experiment: regulate\nforce: 3\nduration: 0.3\nmotion: path\nmotion_file: moved.csv\nout: {out}\n"
    )
    assert main(["regulate", "--config", str(file), "--duration", "0.4"]) == 0
    config = read_config(read_log(out / "latest.mcap").attachments["experiment.yaml"], RegulateConfig)
    assert (config.force, config.duration, config.motion) == (3.0, 0.4, "path")
    file.write_text("frce: 3\n")
    assert main(["regulate", "--config", str(file)]) == 2
    assert "did you mean" in capsys.readouterr().err
    file.write_text("experiment: explore\n")
    assert main(["regulate", "--config", str(file)]) == 2
    assert "must be regulate" in capsys.readouterr().err


def test_a_regulation_that_is_interrupted_is_written_all_the_same(tmp_path, monkeypatch):
    def interrupt(*_):
        os.kill(os.getpid(), signal.SIGINT)
        return Command()

    monkeypatch.setattr("palpate.controllers.RegulateController.step", interrupt)
    assert main(["regulate", "--out", str(tmp_path)]) == 130
    assert (tmp_path / "report.html").exists()
    assert (tmp_path / "forces.csv").exists()
