"""The regions and interfaces in the report of a run."""

import json

import numpy as np
import pytest

import hexconformal as hc
from hexconformal import generate
from hexconformal.mesh import find_regions
from hexconformal.quality import quality
from hexconformal.regularization.region_rows import interface_rows, region_rows, table_lines


def layers(count=3, moved=0.0):
    """A box of layers across x, and the same with all inner nodes of the plane between the first two moved."""
    points, cells = generate.box((2 * count, 4, 4), (float(count), 1.0, 1.0))
    layer = np.floor(points[cells].mean(axis=1)[:, 0]).astype(int)
    other = points.copy()
    inside = (points[:, 0] == 1.0) & (points[:, 1:] > 0).all(axis=1) & (points[:, 1:] < 1).all(axis=1)
    other[inside, 0] += moved
    return hc.HexMesh(points, cells, cell_data={"material": 10 + layer}), other


def rows_of(mesh, points, diagonal=1.0):
    regions = find_regions(mesh)
    interfaces, notes = interface_rows(regions, mesh, points, diagonal)
    return region_rows(regions, quality(mesh), quality(mesh.replaced(points))), interfaces, notes


def test_rows_tell_what_happened_to_every_region_and_interface():
    mesh, points = layers(moved=0.125)
    regions, interfaces, notes = rows_of(mesh, points, diagonal=2.0)
    assert [(row.name, row.cells) for row in regions] == [("10", 32), ("11", 32), ("12", 32)]
    # The moved patch is a pyramid-like bump: nodes 1/4 apart each carry their share of the area.
    bump = 0.125 * 9 / 16
    assert [row.volume_before for row in regions] == pytest.approx([1, 1, 1])
    assert [row.volume_after for row in regions] == pytest.approx([1 + bump, 1 - bump, 1])
    assert regions[0].volume_change == pytest.approx(bump)
    assert regions[2].min_scaled_jacobian_after == pytest.approx(1)
    assert regions[1].min_scaled_jacobian_after < regions[1].mean_scaled_jacobian_after < 1
    assert [(row.regions, row.quads, row.moved) for row in interfaces] == [
        (("10", "11"), 16, 9),
        (("11", "12"), 16, 0),
    ]
    # Both ways: a node of the bump is 1/8 above the plane, and everything else is nearer.
    assert interfaces[0].distance == pytest.approx(0.125 / 2.0, rel=1e-6)
    assert interfaces[1].distance == 0.0
    assert notes == []


def test_inverted_cells_are_counted_where_they_are():
    mesh, points = layers(moved=0.75)
    regions = rows_of(mesh, points)[0]
    assert [row.inverted_before for row in regions] == [0, 0, 0]
    assert [row.inverted_after for row in regions] == [0, 16, 0]
    assert regions[1].min_scaled_jacobian_after < 0


def test_many_interfaces_that_moved_are_measured_together(monkeypatch):
    monkeypatch.setattr("hexconformal.regularization.region_rows._MEASURED", 1)
    mesh, points = layers(4)
    bent = points + np.where(points[:, :1] % 1.0 == 0.0, 0.01, 0.0) * [1.0, 0.0, 0.0]
    _, interfaces, notes = rows_of(mesh, bent, diagonal=2.0)
    assert [row.distance for row in interfaces] == [None, None, None]
    assert notes == ["interfaces: 3 moved, measured all together: by at most 0.005 diagonals"]
    bent[points[:, 0] > 1.0] = points[points[:, 0] > 1.0]
    assert [row.distance for row in rows_of(mesh, bent)[1]] == [pytest.approx(0.01), 0.0, 0.0]


def test_tables_are_aligned_and_short():
    mesh, points = layers(15, moved=0.1)
    regions, interfaces, _ = rows_of(mesh, points)
    lines = table_lines(regions, interfaces[::-1])
    assert len(lines) == 1 + 12 + 1 + 1 + 12 + 1
    assert lines[13] == "and 3 more, in the JSON"
    assert lines[-1] == "and 2 more, in the JSON"
    assert len({len(line) for line in lines[:13]}) == 1
    assert lines[15].startswith("10 | 11")  # the one that moved comes first
    assert max(map(len, lines)) < 100
    assert table_lines((), ()) == []


def test_a_run_reports_them():
    points, cells = generate.jittered(*generate.box((6, 4, 4)), 0.2, seed=1)
    left = generate.box((6, 4, 4))[0][cells].mean(axis=1)[:, 0] < 0.5
    result = hc.regularize(hc.HexMesh(points, cells, cell_data={"material": left.astype(int)}))
    report = result.report
    after = hc.quality((result.points, cells))
    assert [row.volume_after for row in report.regions] == pytest.approx(
        [after.volume[~left].sum(), after.volume[left].sum()]
    )
    assert report.regions[1].min_scaled_jacobian_after == after.scaled_jacobian[left].min()
    assert sum(row.cells for row in report.regions) == len(cells)
    saved = json.loads(report.to_json())
    assert saved["regions"][1]["name"] == "1"
    assert saved["interfaces"][0]["regions"] == ["0", "1"]
    assert "\nregion " in str(report)
    plain = hc.regularize((points, cells)).report
    assert plain.regions == plain.interfaces == ()
    assert "\nregion " not in str(plain)
