"""What `python benchmarks/simulation` does: measure, print the tables, draw the picture, say what is kept."""

import argparse
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from simulation.asked import Answer, accuracy_answers, collision_answers, front_answers, speed_answers
from simulation.collisions import compare_collisions
from simulation.measured import FULL, QUICK, Effort, Findings, measure_all
from simulation.picture import draw, save
from simulation.sensed import Row, sensed_rows
from simulation.tables import EXPLANATION, WIDTH, asked_table, hold_table, sensed_table, touch_table

DESCRIPTION = """\
What every choice of a simulation costs and gives: stage or arm, contact stiffness, integrator and time step, cone,
impedance, impratio, friction plant, every collision on, and what is wrong with the sensor.

Errors are against what MuJoCo itself knows of the contact; costs are processor time of a control period at 1 kHz,
all choices in turns. Four tables (a tip on a stage, on an arm, an object held, a contact sensed), one picture, and
what was asked of the presets of palpate.sim.presets beside what they give. Ends with 1 if something is not kept: a
preset off the front of speed against error, a scene with every collision on that is faster, a figure missed.

About three minutes on a quiet core; --quick takes one speed and one object, --asked leaves the tables out.
"""
PICTURE = Path(__file__).resolve().parents[2] / "runs" / "simulation_speed_error.png"


def main() -> int:
    """Read the command line, measure and show; returns 0 if all that is asked is kept."""
    parser = argparse.ArgumentParser(
        prog="python benchmarks/simulation",
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--quick", action="store_true", help="one speed, one object, fewer rounds: under a minute")
    parser.add_argument("--asked", action="store_true", help="print only what was asked and what is given")
    parser.add_argument("--picture", type=Path, default=PICTURE, help="where to write it (default: %(default)s)")
    arguments = parser.parse_args()
    effort = QUICK if arguments.quick else FULL
    found, rows, answers = measured(effort)
    console = Console(width=WIDTH)
    if not arguments.asked:
        said = f"{', '.join(f'{1e3 * v:g}' for v in effort.speeds)} mm/s"
        console.print(touch_table(f"A tip on a stage, {said}", found.stage))
        console.print(touch_table(f"A tip on a UR5e, {said}", found.arm))
        console.print(touch_table(f"Sensors, on a stage, {said}", found.sensors))
        console.print(hold_table("A box of 0.2 kg held by two fingers with 4 N", found.grasp))
        console.print(sensed_table(rows))
        console.print(EXPLANATION, highlight=False)
        save(draw(found, rows), arguments.picture)
        console.print(f"Picture: {arguments.picture}", highlight=False, soft_wrap=True)
    console.print(asked_table(answers))
    return 0 if all(answer.kept for answer in answers) else 1


def measured(effort: Effort) -> tuple[Findings, list[Row], list[Answer]]:
    """Measure everything, with a progress bar."""
    with Progress(transient=True) as progress:
        choices = progress.add_task("choices", total=None)
        sensed = progress.add_task("contacts sensed", total=30)
        presets = progress.add_task("presets", total=7)
        found = measure_all(
            effort, lambda total: progress.update(choices, total=total), lambda: progress.advance(choices)
        )
        rows = sensed_rows(lambda: progress.advance(sensed))

        def done() -> None:
            progress.advance(presets)

        answers = accuracy_answers(rows, effort, done)
        compared = compare_collisions(effort.pairs, done)
        answers += speed_answers(effort.rounds)
        done()
        answers += collision_answers(compared) + front_answers(found)
    return found, rows, answers
