"""Designs over actors of Ray, each with a mover of its own."""

import ray
from ray.util import ActorPool

from designs import AMOUNTS, move, mover


@ray.remote(num_cpus=1)
class Worker:
    def __init__(self) -> None:
        self.mover = mover()

    def move(self, amount: float) -> tuple[float, float]:
        return move(self.mover, amount)


if __name__ == "__main__":
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    pool = ActorPool([Worker.remote() for _ in range(2)])
    for amount, beta in pool.map(lambda worker, amount: worker.move.remote(amount), AMOUNTS):
        print(f"{amount:.2f} {beta:.17g}")
    ray.shutdown()
