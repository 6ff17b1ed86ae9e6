"""Objects held in simulation while something pulls at them: the runs behind `benchmarks/{holding,sharing}.py`."""
