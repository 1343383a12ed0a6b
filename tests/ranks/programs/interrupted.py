"""The program on ranks, one of which gets a signal in its third iteration."""

import os
import signal
import sys

from mpi4py import MPI

from hexconformal.app import main
from hexconformal.regularization import Regularization

records = Regularization.__iter__


def interrupted(run):
    for record in records(run):
        if record.iteration == 2 and MPI.COMM_WORLD.rank == 1:
            os.kill(os.getpid(), signal.SIGTERM)
        yield record


Regularization.__iter__ = interrupted
sys.exit(main(sys.argv[1:]))
