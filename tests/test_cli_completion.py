"""What a shell completes, asked of a real bash."""

import os
import pty
import re
import select
import shutil
import subprocess
import sys

import pytest

from palpate.cli import main
from support.cli_samples import leaves
from support.waiting import until

BASH = shutil.which("bash")
needs_bash = pytest.mark.skipif(BASH is None, reason="no bash here")


@pytest.fixture(scope="module")
def script(tmp_path_factory):
    """The script for bash, in a folder with files to complete."""
    folder = tmp_path_factory.mktemp("shell")
    path = folder / "completion.bash"
    with path.open("w") as file:
        subprocess.run([sys.executable, "-m", "palpate", "completion", "bash"], check=True, stdout=file)
    (folder / "mine.yaml").touch()
    return path


def completed(script, *lines):
    """What one bash offers for the last word of each line of words."""
    code = f"source '{script}'; COMP_CWORD=0"
    for words in lines:
        quoted = " ".join(f"'{word}'" for word in words)
        code += f"; COMPREPLY=(); COMP_WORDS=(palpate {quoted}); COMP_CWORD={len(words)}; _palpate"
        code += '; printf "%s " "${COMPREPLY[@]}"; echo'
    done = subprocess.run([BASH, "--norc", "-c", code], cwd=script.parent, capture_output=True, text=True)
    assert done.stderr == ""
    return [set(line.split()) for line in done.stdout.splitlines()]


@pytest.mark.slow
@needs_bash
def test_every_command_and_every_option_is_completed(script, capsys):
    names = [name.split() for name in leaves()]
    offered = completed(script, *((*before, last[:2]) for *before, last in names))
    options = completed(script, *((*words, "--") for words in names))
    for words, commands, offers in zip(names, offered, options, strict=True):
        assert words[-1] in commands
        with pytest.raises(SystemExit):
            main([*words, "--help"])
        shown = set(re.findall(r"^[│| ] (?:-h, )?(--[a-z][a-z0-9-]*)", capsys.readouterr().out, re.MULTILINE))
        assert shown, "help without options"
        assert shown <= offers, words


COMPLETED = {
    ("expl",): {"explore"},
    ("explore", "--forc"): {"--force", "--force-swing", "--force-period", "--force-noise"},
    ("explore", "--strategy", "ra"): {"raster"},
    ("explore", "--turn", ""): {"left", "right"},
    ("explore", "--force", ""): set(),
    ("explore", "--out", "mi"): {"mine.yaml"},
    ("calibrate", "new", "x.yaml", "--preset", ""): {"nano17", "axia80", "ft300s", "ur5e"},
    ("log", ""): {"info", "export", "ros2", "--help", "-h"},
}


@pytest.mark.slow
@needs_bash
def test_values_are_completed_by_their_kind(script):
    assert completed(script, *COMPLETED) == list(COMPLETED.values())


@pytest.mark.slow
@needs_bash
def test_a_real_shell_completes_at_a_tab(script):
    """With a terminal, its own line editor, and the key."""
    child, terminal = pty.fork()
    if child == 0:
        os.chdir(script.parent)
        os.execve(BASH, [BASH, "--norc", "--noprofile", "-i"], {**os.environ, "PS1": "$ ", "TERM": "dumb"})
    try:
        os.write(terminal, b"source completion.bash; palpate() { printf '<%s>' \"$@\"; echo .; }\n")
        os.write(terminal, b"palpate expl\t--obj\tell\t--file mi\t\n")
        said = bytearray()

        def heard():
            if select.select([terminal], [], [], 0.5)[0]:
                said.extend(os.read(terminal, 65536))
            return b"<explore><--object><ellipsoid><--file><mine.yaml>." in said

        until(heard)
    finally:
        os.write(terminal, b"exit\n")
        os.close(terminal)
        os.waitpid(child, 0)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_script_names_every_command_and_reads_as_the_shell_has_it(shell, capsys):
    assert main(["completion", shell]) == 0
    text = capsys.readouterr().out
    for name in leaves():
        assert f"'{name.split()[-1]}'" in text
    program = shutil.which(shell)
    if program is not None:
        done = subprocess.run([program, "-n"], input=text, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
