"""Start a ray cluster of two nodes on this computer, print its address, and stop it when standard input ends.

A program of its own: ray threads, sockets and warnings stay out of whoever tests.
"""

import os
import sys

STORE = 80 * 2**20
"""Memory for shared objects [bytes]: ray's least is 75 MB."""


def main():
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    from ray.cluster_utils import Cluster

    node = {
        "num_cpus": 1,
        "object_store_memory": STORE,
        "include_dashboard": False,
        "node_ip_address": "127.0.0.1",
    }
    cluster = Cluster(initialize_head=True, head_node_args=node)
    try:
        cluster.add_node(num_cpus=1, object_store_memory=STORE, node_ip_address="127.0.0.1")
        sys.stdout.write(f"{cluster.address}\n")
        sys.stdout.flush()
        sys.stdin.read()
    finally:
        cluster.shutdown()


if __name__ == "__main__":
    main()
