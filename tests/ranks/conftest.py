"""Programs on ranks: started by mpiexec, ended by a time limit, skipped where there is no MPI or no PETSc."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

PROGRAMS = Path(__file__).with_name("programs")
SECONDS = 300  # that a program may take: machines may be shared
# Open MPI: as root, with more ranks than processors, which they give away while they wait. MPICH does not mind.
SETTINGS = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMPI_MCA_mpi_yield_when_idle": "1",
    "HEXCONFORMAL_THREADS": "1",
    "OMP_NUM_THREADS": "1",
}


@pytest.fixture(scope="session")
def mpiexec():
    """A function that runs python on so many ranks; the test is skipped where that cannot be."""
    if shutil.which("mpiexec") is None:
        pytest.skip("there is no mpiexec on this machine")
    reason = _why_not()
    if reason:
        pytest.skip(reason)

    def run(ranks, *words, fails=False, module=("-m", "mpi4py"), **more):
        command = ["mpiexec", "-n", str(ranks), sys.executable, *module, *map(str, words)]
        more = {"capture_output": True, "text": True, "timeout": SECONDS, **more}
        done = subprocess.run(command, env={**os.environ, **SETTINGS}, **more)
        assert (done.returncode != 0) == fails, done.stdout + done.stderr
        return done

    return run


def _why_not():
    """Why programs on ranks cannot be run here, in words; nothing where they can."""
    tried = "from mpi4py import MPI; from petsc4py import PETSc; print(MPI.COMM_WORLD.size)"
    try:
        done = subprocess.run(
            ["mpiexec", "-n", "2", sys.executable, "-c", tried],
            env={**os.environ, **SETTINGS},
            capture_output=True,
            text=True,
            timeout=120,
        )
    except subprocess.TimeoutExpired:
        return "mpiexec does not come to an end"
    if done.returncode:
        return f"mpi4py or petsc4py cannot be used: {(done.stderr.strip().splitlines() or ['?'])[-1]}"
    return "" if "".join(done.stdout.split()) == "22" else "mpi4py is of another MPI than mpiexec"


@pytest.fixture(scope="session")
def results(mpiexec, tmp_path_factory):
    """What a program in `programs` saves on so many ranks; run once for all that ask for it."""
    known = {}

    def of(program, ranks):
        if (program, ranks) not in known:
            target = tmp_path_factory.mktemp("ranks") / f"{program}_{ranks}.npz"
            mpiexec(ranks, PROGRAMS / f"{program}.py", target)
            known[program, ranks] = dict(np.load(target, allow_pickle=False))
        return known[program, ranks]

    return of
