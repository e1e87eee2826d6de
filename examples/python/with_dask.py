"""Designs over a cluster of Dask.

    python with_dask.py [SCHEDULER]     a scheduler's address, such as tcp://host:8786; a LocalCluster without one
"""

import sys

from dask.distributed import Client, LocalCluster

from designs import AMOUNTS, move, mover

if __name__ == "__main__":
    if len(sys.argv) > 1:
        client = Client(sys.argv[1])
    else:
        client = Client(LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None))
    with client:
        # Sent once to each worker.
        own = client.scatter(mover(), broadcast=True)
        for amount, beta in client.gather([client.submit(move, own, amount) for amount in AMOUNTS]):
            print(f"{amount:.2f} {beta:.17g}")
