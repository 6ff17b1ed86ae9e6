# %% [markdown]
"""A notebook.

Each `# %%` begins a cell, which VS Code, Spyder, PyCharm and Jupyter (with jupytext) run one by one; what
stands on the last line of a cell is shown below it. Contacts show their quantities with units; what an experiment
or a sweep found shows its key figures and the first figure of its report. `notebook.ipynb` is the same for Jupyter
and Colab.

    python examples/notebook.py

Run as a script it shows nothing, but prints at the end how well the force was held.
"""

# ruff: noqa: B018, what stands alone is shown

# %%
import matplotlib.pyplot as plt
import numpy as np

import palpate as pp

tip = pp.Ellipsoid(semi_axes=(0.008, 0.008, 0.012))  # [m], in the sensor frame
contact = pp.contact_from_wrench(tip, [0.3, 0.1, -2.0, 0.004, 0.008, 0.003])  # [N, N m]
contact

# %% An exploration: 12 x 4 mm of a sphere, with 2 N and 50 mm/s
config = pp.ExploreConfig(robot="stage-nano17", object="sphere", width=0.012, depth=0.004, speed=0.05)
found = pp.explore(config, progress=True)
found

# %% The normal force over time [N], and its spectrum [N / sqrt(Hz)]
record = found.record
figure, (over_time, spectrum) = plt.subplots(2, layout="constrained")
over_time.plot(record.time, record.normal_force, label="felt")
over_time.plot(record.time, found.true_normal_force, label="true")
over_time.set(xlabel="time [s]", ylabel="normal force [N]")
over_time.legend()
error = (record.normal_force - found.set_force)[found.scanning]
period = found.run.timing.period  # [s]
density = np.abs(np.fft.rfft(error - error.mean())) * np.sqrt(2.0 * period / len(error))
spectrum.loglog(np.fft.rfftfreq(len(error), period)[1:], density[1:])
spectrum.set(xlabel="frequency [Hz]", ylabel="[N / sqrt(Hz)]")
figure

# %%
print(f"{found.run}: the force was held within {found.force_rms:.3f} N RMS")
