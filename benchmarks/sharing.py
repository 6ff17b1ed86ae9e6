"""Three fingers that share a load: grip over the theoretical least, slip, spin and drops.

python benchmarks/sharing.py                 # 12 runs of each kind
python benchmarks/sharing.py --runs 100      # what is asked for: an hour and a half
"""

import argparse

from grip.sharing_run import estimated, known, worst


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=12, help="runs of each kind")
    parser.add_argument("--first", type=int, default=1000, help="seed of the first")
    parser.add_argument("--only", choices=("known", "estimated"), help="only this kind")
    parser.add_argument("--loads", nargs="+", default=["ramp"], choices=("ramp", "step", "shake"))
    chosen = parser.parse_args()
    for load in chosen.loads:
        for name, run in (("known", known), ("estimated", estimated)):
            if chosen.only not in (None, name):
                continue
            found = []
            for seed in range(chosen.first, chosen.first + chosen.runs):
                found.append(run(seed, load))
                print(f"  {load}, {name}, seed {seed}: {worst(found[-1:])}", flush=True)
            print(f"{load}, mu and e {name}: {worst(found)}", flush=True)


if __name__ == "__main__":
    main()
