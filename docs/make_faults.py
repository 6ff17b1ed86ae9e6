"""The page `docs/faults.md`: every kind of fault that the campaign tries, and what came of it when last measured.

python docs/make_faults.py                  # write the page: `make api`
python docs/make_faults.py --check          # exit code 1 if it is not what the table says: `make check`
python docs/make_faults.py FILE.jsonl ...   # take over what `benchmarks/faults --json` measured, then write it
"""

import json
import sys
from collections import defaultdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "benchmarks"))

from faults.kind import Domain, Kind
from faults.table import KINDS, KNOWN

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "faults.md"
MEASURED = ROOT / "benchmarks" / "faults" / "measured.csv"
"""For each kind: how often it was tried, how often all was right."""

INTRODUCTION = """# Faults at random moments

<!-- Made by docs/make_faults.py from benchmarks/faults: do not edit. -->

{kinds} kinds of faults, each tried at moments that are drawn from a seed: on simulated robots whose truth is
known, on emulated devices behind the makers' own client libraries, on whole commands in processes of their own.
After each it is judged whether

- the robot is at rest, as simulation or emulator measures it, and palpate reports the same;
- true force kept to 1.5 times its limit (and what one period at the allowed speed adds), speed and commanded grip
  to 1.02 times theirs;
- nothing is left behind: processes, ports, threads, shared memory, temporary files;
- exit code, report and log are as [promised](running.md), and the log of a killed process lacks at most its last
  half second;
- the next run works.

When last measured: {tries} tries of {tried} kinds, {right} right ({share:.1f} %), on two cores; processes,
protocols and networks while others used them, too (load 5 to 16).

    python benchmarks/faults --list                  # the kinds
    python benchmarks/faults --moments 10 --seed 1   # all of them: hours; --kinds: a part; --json keeps each try
    python benchmarks/faults --robot my-cell.yaml    # those that can be tried anywhere (*), on a robot of yours
    python benchmarks/faults --search 300            # instead: search for the worst controller and sensor

`--robot` takes the name of a robot, a robot file, or `module:factory`, which returns a
`palpate.robots.robot.Robot`: so do a back end and a sensor of one's own, by
[their robot file](robot-files.md). On a real robot mind what it may run into. A handful of kinds, drawn anew with
each commit, runs with the long tests. What a rig says of each fault of its devices, and how fast, is
[another page](wire-faults.md).
"""

SEARCHED = """
## The worst that a search found

`python benchmarks/faults --search 100 --seed 1`, 100 tries of each: a controller that plunges, waves and turns
aside as it likes, a sensor that is turned, scaled, late, frozen or off, both, and a controller of a hand. Largest
value, as a multiple of its limit:

| quantity | onto a plate, at contact speed | free space, stage | free space, UR5e | hand | may be |
|---|---|---|---|---|---|
| true force | 1.22 | | | | 1.5, and a period |
| commanded speed | 0.40 | 1.00 | 1.00 | | 1.02 |
| true speed | 0.40 | 0.53 | **1.11** | | 1.02 |
| acceleration | 1.00 | 1.00 | 1.00 | | 1.02 |
| position | 1.00 | 1.00 | 1.00 | | 1.02 |
| commanded grip | | | | 1.00 | 1.02 |
| true grip | | | | **1.21** | 1.02 |

- In free space the plan allows the whole speed limit, 0.25 m/s, as none of ours does.
- Acceleration is that of commands: of the controller, and of a reaction from its stop on. How hard the robot is
  stopped is not limited. A first search that counted the stop itself found 10.
- Position is 1 and the share of the workspace's width by which the tip was outside. It was up to 1.07 before the
  supervisor began to brake before the bound.
- The true speed is the overshoot of the simulated servos after a commanded 25 m/s^2; with 5 m/s^2, as a UR arm
  follows velocities, it is 1.04. The supervisor stops an arm above 1.1.
- The true grip is a swing of a finger's mass, mostly its rotor's behind the gear, after a commanded jump or wave.
  The supervisor stops then, grip kept. A hand whose grip must not be exceeded needs a limit a fifth below that.
"""

ABOUT = {
    Domain.PROCESS: "Signals and closed terminals at every stage of a command; kill -9 of each of its processes.",
    Domain.RESOURCE: "What a command runs out of, or loses, while it moves an emulated arm.",
    Domain.PROTOCOL: "What comes over the wire, from devices and through a proxy; and starts that hang.",
    Domain.SUPERVISION: "What passes through the loop: hostile controllers, wrong sensors, wrong mountings.",
    Domain.INPUT: "Damaged files for every reader, and options that no robot can follow.",
    Domain.NETWORK: "What a network does, through a proxy, while an emulated arm holds a force.",
}

Counts = dict[str, tuple[int, int]]


def measured() -> Counts:
    """Return tries and right ones by kind, as last taken over."""
    if not MEASURED.exists():
        return {}
    rows = (line.rsplit(",", 2) for line in MEASURED.read_text(encoding="utf-8").splitlines()[1:])
    return {name: (int(tries), int(right)) for name, tries, right in rows}


def take_over(files: list[str]) -> None:
    """Write what files of the campaign say as what was measured; kinds that they lack stay."""
    found: dict[str, list[bool]] = defaultdict(list)
    for file in files:
        for line in Path(file).read_text(encoding="utf-8").splitlines():
            one = json.loads(line)
            found[one["kind"]].append(not one["problems"])
    counts = measured() | {name: (len(those), sum(those)) for name, those in found.items()}
    rows = (f"{kind.name},{counts[kind.name][0]},{counts[kind.name][1]}" for kind in KINDS if kind.name in counts)
    MEASURED.write_text("\n".join(["kind,tries,right", *rows, ""]), encoding="utf-8")


def page() -> str:
    """Return the page, Markdown."""
    counts = measured()
    tries, right = (sum(each[i] for each in counts.values()) for i in (0, 1))
    share = 100.0 * right / max(1, tries)
    lines = [INTRODUCTION.format(kinds=len(KINDS), tries=tries, tried=len(counts), right=right, share=share)]
    if KNOWN:
        lines += ["## Not always right yet", "", "| kind | what is wrong |", "|---|---|"]
        lines += [f"| {name} | {cause} |" for name, cause in KNOWN.items()]
    lines += ["", SEARCHED.strip()]
    for domain in Domain:
        those = [kind for kind in KINDS if kind.domain is domain]
        lines += ["", f"## {domain.value.capitalize()}: {len(those)} kinds", "", ABOUT[domain], ""]
        lines += ["| kind | right of tries |", "|---|---|", *(_row(kind, counts) for kind in those)]
    return "\n".join(lines) + "\n"


def _row(kind: Kind, counts: Counts) -> str:
    tries, right = counts.get(kind.name, (0, 0))
    return f"| {kind.name}{' *' if kind.anywhere else ''} | {f'{right} of {tries}' if tries else ''} |"


def main(arguments: list[str]) -> int:
    """Write the page, or with `--check` only compare it; return the exit code."""
    if arguments == ["--check"]:
        if PAGE.exists() and PAGE.read_text(encoding="utf-8") == page():
            return 0
        print("docs/faults.md is not what the table says: run `make api`", file=sys.stderr)
        return 1
    if arguments:
        take_over(arguments)
    PAGE.write_text(page(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
