"""The program on ranks, one of which gets a signal while it measures."""

import os
import signal
import sys

from mpi4py import MPI

from hexconformal.app import main, on_ranks

measured = on_ranks.quality


def interrupted(piece):
    if MPI.COMM_WORLD.rank == 1:
        os.kill(os.getpid(), signal.SIGTERM)
    return measured(piece)


on_ranks.quality = interrupted
sys.exit(main(sys.argv[1:]))
