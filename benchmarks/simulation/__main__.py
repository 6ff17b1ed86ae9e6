"""Cost and error of every choice of a simulation, against MuJoCo's own state.

    python benchmarks/simulation [stage | arm | hand | asked | step ...] [--quick]

stage, arm, hand: integrator and time step, cone, impedance, impratio, stiffness, friction plant and collisions
around the presets of palpate.sim.presets; processor time of a control period at 1 kHz, all choices in turns, and
whether the preset lies on the front of speed and error. asked: what
the presets keep. step: a force held on a moving surface, by time step. About three minutes on a quiet core. Ends
with 1 if a preset is beaten or a figure is missed.
"""

import sys
from pathlib import Path

if __name__ == "__main__":
    sys.path[0] = str(Path(__file__).resolve().parents[1])
    from harness.command import start

    from simulation.study import PARTS

    start(__doc__, PARTS)
