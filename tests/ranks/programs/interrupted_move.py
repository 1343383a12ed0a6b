"""The program on ranks, one of which gets a signal in the third step of a motion."""

import os
import signal
import sys

from mpi4py import MPI

from hexconformal.app import main
from hexconformal.motion import MeshMotion

once, calls = MeshMotion.step, iter(range(9))


def interrupted(motion, displacement, dt=None):
    if next(calls) == 2 and MPI.COMM_WORLD.rank == 1:
        os.kill(os.getpid(), signal.SIGTERM)
    return once(motion, displacement, dt)


MeshMotion.step = interrupted
sys.exit(main(sys.argv[1:]))
