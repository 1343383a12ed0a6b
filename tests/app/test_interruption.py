"""Ctrl-C and SIGKILL at random moments: files are whole, what is written is valid, and runs go on.

HEXCONFORMAL_MOMENTS=100 tries as many moments for each command and signal.
"""

import json
import os
import signal
import threading
import time

import numpy as np
import pytest
import pyvista as pv
from meshes.surfaces import icosphere, shaken
from program import history

import hexconformal as hc
import surface
from hexconformal.app.cli import main
from hexconformal.common.interruption import as_interruption
from hexconformal.elements import is_valid
from hexconformal.generate import box, jittered

MOMENTS = int(os.environ.get("HEXCONFORMAL_MOMENTS", "2"))
CLOCKS = ("seconds", "cpu")
pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="signals of another kind")


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    """A jittered box, one whose lid moves, a bumpy ball; and what the whole runs of the four commands come to."""
    folder = tmp_path_factory.mktemp("inputs")
    hc.write(folder / "part.vtu", hc.HexMesh(*jittered(*box((4, 4, 4)), 0.45, keep_boundary=False)))
    points, cells = box((3, 3, 3))
    hc.write(folder / "box.vtu", hc.HexMesh(points, cells))
    lid = np.flatnonzero(points[:, 2] == 1)
    rows = [f"{step},{node},{0.02 * step},0,{0.03 * step}" for step in range(1, 11) for node in lid]
    (folder / "lid.csv").write_text("\n".join(["step,node,dx,dy,dz", *rows]) + "\n")
    ball, cells = shaken(icosphere(1), 0.05)
    surface.write(folder / "ball.ply", (ball * [1.0, 0.8, 1.3], cells.triangles))
    return folder


def commands(inputs, place):
    regularize = ["regularize", f"{inputs}/part.vtu", f"{place}/out.vtu", "--history", f"{place}/run.csv", "--quiet"]
    return {
        "regularize": [*regularize, "--report", f"{place}/report.json", "--frames", f"{place}/run.pvd"],
        "remesh": ["remesh", f"{inputs}/ball.ply", f"{place}/out.ply", "--history", f"{place}/run.csv", "--quiet"],
        "flow": ["flow", f"{inputs}/ball.ply", f"{place}/run", "--steps", "5", "--remesh", "--quiet"],
        "move": ["move", f"{inputs}/box.vtu", f"{place}/run", "--motion", f"{inputs}/lid.csv", "--quiet"],
        "quality": ["quality", f"{inputs}/part.vtu", "--out", f"{place}/out.xdmf", "--json", f"{place}/out.json"],
        "orient": ["orient", f"{inputs}/part.vtu", f"{place}/out.inp"],
        "check": ["check", f"{inputs}/part.vtu"],
        "demo": ["demo", f"{place}/demo", "--size", "3"],
    }


def interrupted(words, after):
    """Ctrl-C while the command runs in this process."""
    timer = threading.Timer(after, os.kill, (os.getpid(), signal.SIGINT))
    try:
        timer.start()
        code = main(words)
        timer.cancel()
        timer.join()
    except KeyboardInterrupt:
        code = None  # it came too late, or before anything had begun
    assert code in (0, 130, None)


def killed(words, after):
    """SIGKILL while the command runs in another process."""
    child = os.fork()
    if child == 0:
        os._exit(main(words))
    time.sleep(after)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)


def duration(words):
    began = time.perf_counter()
    assert main(words) == 0
    return time.perf_counter() - began


def moments(name, end):
    rng = np.random.default_rng(list(name.encode()))
    return rng.uniform(0.0, 1.1 * end, MOMENTS)


def nothing_left_over(place, stop):
    if stop is interrupted:
        assert [path.name for path in place.rglob(".*")] == []
    for path in place.rglob("*"):
        if path.is_file() and not any(part.startswith(".") for part in path.relative_to(place).parts):
            if path.suffix in (".vtu", ".ply", ".vtp"):
                assert pv.read(path).n_points > 0
            elif path.suffix == ".npz":
                with np.load(path) as file:
                    assert all(file[key] is not None for key in file.files)
            elif path.suffix == ".pvd":
                assert path.read_text().rstrip().endswith("</VTKFile>")
                assert len(pv.get_reader(path).time_values) > 0


@pytest.mark.long
@pytest.mark.parametrize("stop", [interrupted, killed])
@pytest.mark.parametrize("name", ["regularize", "remesh"])
def test_a_mesh_is_the_old_one_or_a_valid_better_one(name, stop, inputs, tmp_path):
    (tmp_path / "whole").mkdir()
    end = duration(commands(inputs, tmp_path / "whole")[name])
    for number, after in enumerate(moments(name, end)):
        place = tmp_path / str(number)
        place.mkdir()
        words = commands(inputs, place)[name]
        source, out = words[1:3]
        module = hc if name == "regularize" else surface
        module.write(out, module.read(source) if name == "remesh" else hc.read(source))
        stop(words, after)
        nothing_left_over(place, stop)
        mesh = module.read(out)
        if name == "regularize":
            started = is_valid(hc.read(source).points, mesh.cells)
            assert is_valid(mesh.points, mesh.cells)[started].all()
        else:
            assert surface.quality(mesh).min_angle.min() >= surface.quality(surface.read(source)).min_angle.min() - 1e-6


@pytest.mark.long
@pytest.mark.parametrize("stop", [interrupted, killed])
@pytest.mark.parametrize("name", ["flow", "move"])
def test_a_run_goes_on_as_if_nothing_had_been(name, stop, inputs, tmp_path):
    whole = tmp_path / "whole"
    whole.mkdir()
    end = duration(commands(inputs, whole)[name])
    for number, after in enumerate(moments(name, end)):
        place = tmp_path / str(number)
        place.mkdir()
        words = commands(inputs, place)[name]
        stop(words, after)
        nothing_left_over(place, stop)
        begun = (place / "run" / "checkpoint.npz").exists()
        assert main([*words, "--resume"] if begun else words) == 0
        assert history(place / "run" / "history.csv", *CLOCKS) == history(whole / "run" / "history.csv", *CLOCKS)
        np.testing.assert_array_equal(
            pv.read(place / "run" / "last.vtu").points, pv.read(whole / "run" / "last.vtu").points
        )
        assert len(pv.get_reader(place / "run" / "run.pvd").time_values) == len(
            pv.get_reader(whole / "run" / "run.pvd").time_values
        )


@pytest.mark.long
@pytest.mark.parametrize("stop", [interrupted, killed])
@pytest.mark.parametrize("name", ["quality", "orient", "check", "demo"])
def test_what_is_there_is_whole_and_inputs_stay(name, stop, inputs, tmp_path):
    pytest.importorskip("h5py")
    before = {path: path.read_bytes() for path in inputs.iterdir()}
    (tmp_path / "whole").mkdir()
    end = duration(commands(inputs, tmp_path / "whole")[name])
    for number, after in enumerate(moments(name, end)):
        place = tmp_path / str(number)
        place.mkdir()
        stop(commands(inputs, place)[name], after)
        nothing_left_over(place, stop)
        for path in (place / "out.xdmf", place / "out.inp"):
            assert not path.exists() or len(hc.read(path).cells) == 64
        if (place / "out.json").exists():
            json.loads((place / "out.json").read_text())
        assert {path: path.read_bytes() for path in inputs.iterdir()} == before


def test_an_interruption_at_the_edge_of_compiled_code_is_one_and_other_errors_stay_themselves():
    def left_with(cause):
        with as_interruption():
            raise SystemError("returned a result with an exception set") from cause

    with pytest.raises(KeyboardInterrupt):
        left_with(KeyboardInterrupt())
    with pytest.raises(SystemError):
        left_with(None)
