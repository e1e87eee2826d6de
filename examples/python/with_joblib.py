"""Designs over the processes of joblib's loky."""

from joblib import Parallel, delayed

from designs import AMOUNTS, move, mover

if __name__ == "__main__":
    own = mover()
    for amount, beta in Parallel(n_jobs=2)(delayed(move)(own, amount) for amount in AMOUNTS):
        print(f"{amount:.2f} {beta:.17g}")
