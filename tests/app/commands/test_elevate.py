"""`elevate`, and the other commands on what it makes."""

import numpy as np
import pytest
import pyvista as pv
from program import run

import hexconformal as hc
from hexconformal.generate import cylinder


@pytest.mark.long
def test_command(here, capsys):
    assert run("elevate part.vtu curved.vtu --to 27") == 0
    out = capsys.readouterr().out
    raised, linear = hc.quality("curved.vtu"), hc.quality("part.vtu")
    assert f"{len(linear.volume)} hexahedra of 27 nodes, " in out
    np.testing.assert_allclose(raised.volume, linear.volume)
    assert run("quality curved.vtu --out measured.vtu --json q.json --plot q.png") == 0
    assert f"{len(linear.volume)} hexahedra of 27 nodes, " in capsys.readouterr().out
    np.testing.assert_array_equal(hc.as_volume_mesh("measured.vtu").cell_data["volume"], raised.volume)
    assert run("check curved.vtu") == 0
    assert "warning: cells of higher order: " in capsys.readouterr().out
    assert run("regularize curved.vtu better.vtu --target 1:1:2") == 2
    assert "there is no target" in capsys.readouterr().err
    assert run("regularize curved.vtu better.vtu --boundary fixed --frames f.pvd --history h.csv --plot p.png") == 0
    assert "energy" in capsys.readouterr().out
    better = hc.as_volume_mesh("better.vtu")
    assert set(better.cell_data) >= {"scaled_jacobian", "scaled_jacobian_change"}
    assert hc.quality(better).valid.all()
    assert run("quality curved.vtu --linearize") == 0
    assert "hexahedra of" not in capsys.readouterr().out
    assert run("elevate part.vtu part2.vtu --to 8") == 2
    assert "must be 20 or 27" in capsys.readouterr().err


def test_between_corners_the_boundary_follows_a_surface(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    points, cells = cylinder(2, 1, 1)
    hc.write("straight.vtu", hc.HexMesh(points, cells))
    radius, height = np.linalg.norm(points[:, :2], axis=1).max(), points[:, 2].max()
    size = {"radius": radius, "height": height, "resolution": 100}
    pv.Cylinder(center=(0, 0, height / 2), direction=(0, 0, 1), **size).triangulate().save("part.stl")
    assert run("elevate straight.vtu curved.vtu --to 27 --surface part.stl") == 0
    assert "away from the surface; with straight edges 0.0757" in capsys.readouterr().out
    assert hc.quality("curved.vtu").volume.sum() == pytest.approx(np.pi * radius**2 * height, rel=2e-3)
    for flag in ("--linearize", "--linearise"):
        assert run(f"quality curved.vtu {flag}") == 0
        assert f"volume {hc.quality('straight.vtu').volume.sum():.6g}" in capsys.readouterr().out
    assert run("elevate straight.vtu part.stl --surface part.stl") != 0


def test_what_is_not_valid_is_told(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    points, cells = hc.generate.box((2, 2, 2))
    hc.write("mirrored.vtu", (points * [1.0, 1.0, -1.0], cells))
    assert run("elevate mirrored.vtu curved.vtu") == 0
    out = capsys.readouterr().out
    assert "note: cells that are not valid: 8 (first ids 0, 1, 2, 3, 4)" in out
    assert "orient() turns them round" in out
    points[13] = [0.5, 0.5, 1.2]
    hc.write("folded.vtu", (points, cells))
    assert run("elevate folded.vtu curved.vtu --overwrite") == 0
    out = capsys.readouterr().out
    assert "note: cells that are not valid: 4 (ids 4, 5, 6, 7)" in out
    assert "orient" not in out
    assert run("elevate curved.vtu straight.vtu --linearize --to 27") == 0
    assert "note: cells that are not valid: 4 (ids 4, 5, 6, 7)" in capsys.readouterr().out
