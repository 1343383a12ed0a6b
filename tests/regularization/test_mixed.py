"""Meshes of several types of cells are unfolded and improved, as those of hexahedra are."""

import meshio
import numpy as np
import pytest
import pyvista as pv
from meshes.mixed import cut_block, jittered_inside, mixed_block, shuffled_grid, smallest_determinants
from paths import SHARED

import hexconformal as hc
from hexconformal.common import OptionError
from hexconformal.elements import WEDGE, collapsed_cells
from hexconformal.generate import box, cylinder
from hexconformal.mesh import MixedMesh, blocks_of, boundary_quads, collapsed_mesh

NAMES = ("hexahedron", "wedge", "pyramid", "tetra")


def minima(mesh):
    return {name: one.scaled_jacobian.min for name, one in hc.quality(mesh).summary().types.items()}


def test_a_tangled_block_of_all_types_becomes_valid_and_keeps_its_box():
    mesh = jittered_inside(mixed_block(3), 0.45, seed=1)
    assert (smallest_determinants(mesh) <= 0).sum() > 20
    result = hc.regularize(mesh)
    assert isinstance(result.mesh, MixedMesh)
    assert (smallest_determinants(result.mesh) > 0).all()
    assert result.report.after.invalid == 0
    least = minima(result.mesh)
    assert set(least) == set(NAMES)
    assert least["hexahedron"] > 0.9
    assert least["wedge"] > 0.6  # .816 where the triangles are right-angled
    assert min(least["pyramid"], least["tetra"]) > 0.3
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    for bound in (low, high):
        on = mesh.points == bound
        np.testing.assert_array_equal(result.points[on], np.broadcast_to(bound, mesh.points.shape)[on])
    assert result.report.after.total_volume == pytest.approx(float(np.prod(high - low)), rel=1e-12)


def test_a_fixed_boundary_stays_bit_by_bit():
    mesh = jittered_inside(mixed_block(3), 0.3, seed=2)
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    on = ((mesh.points == low) | (mesh.points == high)).any(axis=1)
    result = hc.regularize(mesh, boundary="fixed")
    assert result.report.after.invalid <= result.report.before.invalid
    np.testing.assert_array_equal(result.points[on], mesh.points[on])
    assert (result.points[~on] != mesh.points[~on]).any()


@pytest.mark.parametrize("seed", range(3))
def test_no_type_gets_worse(seed):
    mesh = jittered_inside(mixed_block(3), 0.12, seed=seed)
    before = minima(mesh)
    assert min(before.values()) > 0.0
    result = hc.regularize(mesh)
    after = minima(result.mesh)
    assert all(after[name] >= before[name] - 1e-6 for name in NAMES), (before, after)
    assert min(after.values()) > min(before.values()) + 0.02


def test_perfect_cells_of_one_type_do_not_keep_the_others_as_they_are():
    mesh = mixed_block(3)
    perfect = np.zeros(len(mesh.points), dtype=bool)
    for block in mesh.blocks:
        if block.cell_type.name == "hexahedron":
            perfect[block.cells] = True
    shaken = jittered_inside(mesh, 0.15).points
    mesh = mesh.replaced(np.where(perfect[:, None], mesh.points, shaken))
    before, after = minima(mesh), minima(hc.regularize(mesh).mesh)
    assert before["hexahedron"] == 1.0
    assert after["hexahedron"] > 1.0 - 1e-6
    assert after["tetra"] > before["tetra"] + 0.2
    assert all(after[name] >= before[name] - 1e-6 for name in NAMES)


def test_tetrahedra_alone():
    mesh = jittered_inside(cut_block(5), 0.45, seed=4)
    assert hc.quality(mesh).summary().invalid > 0
    report = hc.regularize(mesh).report
    assert report.after.invalid == 0
    assert report.after.shape.min > 0.4
    assert report.converged


@pytest.mark.long
def test_wedges_of_a_swept_cylinder_slide_along_its_curved_side():
    points, cells = cylinder(4, 3, 6)
    wedges = np.concatenate([cells[:, [0, 1, 2, 4, 5, 6]], cells[:, [0, 2, 3, 4, 6, 7]]])
    inside = np.ones(len(points), dtype=bool)
    inside[boundary_quads(cells)[0]] = False
    points = points + np.random.default_rng(0).uniform(-0.06, 0.06, points.shape) * inside[:, None]
    mesh = MixedMesh.of_types(points, {"wedge": wedges})
    result = hc.regularize(mesh)
    assert result.report.after.invalid == 0
    assert 0.0 < result.report.hausdorff <= 0.005
    assert result.report.boundary_moved > 0
    assert result.report.after.scaled_jacobian.min > result.report.before.scaled_jacobian.min + 0.05
    assert abs(result.report.volume_change) < 0.005


def test_the_order_of_cells_and_of_wedges_changes_nothing():
    mesh = jittered_inside(mixed_block(2), 0.35, seed=5)
    rng = np.random.default_rng(0)
    cells = {block.cell_type.name: rng.permutation(block.cells) for block in mesh.blocks[::-1]}
    cells["wedge"] = cells["wedge"][:, [3, 4, 5, 0, 1, 2]]
    one, other = hc.regularize(mesh), hc.regularize(MixedMesh.of_types(mesh.points, cells))
    np.testing.assert_array_equal(one.points, other.points)
    assert any("reverse order" in note for note in other.report.notes)
    np.testing.assert_array_equal(other.mesh.blocks[0].cells, cells[other.mesh.blocks[0].cell_type.name])


@pytest.mark.parametrize("library", ["meshio", "pyvista"])
def test_a_mesh_comes_back_as_it_came_with_new_points(library, tmp_path):
    mesh = jittered_inside(mixed_block(2), 0.3, seed=6)
    grid = shuffled_grid(mesh)
    grid.cell_data["number"] = np.arange(grid.n_cells)
    source = pv.to_meshio(grid) if library == "meshio" else grid
    result = hc.regularize(source)
    assert type(result.mesh) is type(source)
    if library == "meshio":
        for old, new in zip(source.cells, result.mesh.cells, strict=True):
            assert old.type == new.type
            np.testing.assert_array_equal(old.data, new.data)
    else:
        np.testing.assert_array_equal(source.cell_connectivity, result.mesh.cell_connectivity)
        np.testing.assert_array_equal(result.mesh.cell_data["number"], np.arange(grid.n_cells))
        quads = grid.celltypes == 9
        assert np.isnan(result.mesh.cell_data["scaled_jacobian"][quads]).all()
        assert (result.mesh.cell_data["scaled_jacobian"][~quads] > 0).all()
    assert (np.abs(result.mesh.points - mesh.points) > 0.01).any()


def test_an_interface_of_triangles_and_quadrilaterals_stays_in_its_plane():
    mesh = mixed_block(2)
    collapsed = collapsed_mesh(mesh)
    x = mesh.points[collapsed.cells].mean(axis=1)[:, 0]
    moved = jittered_inside(mesh, 0.15, seed=7)
    points = moved.points.copy()
    # Two of them: between hexahedra and pyramids, and through the tetrahedra.
    for plane in (4.0, 6.0):
        points[mesh.points[:, 0] == plane, 0] = plane
    regions = np.where(x < 4.0, 1, np.where(x < 6.0, 2, 3))
    result = hc.regularize(MixedMesh(points, mesh.blocks, {}, {"material": regions}))
    for plane in (4.0, 6.0):
        on = mesh.points[:, 0] == plane
        np.testing.assert_allclose(result.points[on, 0], plane, atol=1e-12)
        assert (np.abs(result.points[on, 1:] - points[on, 1:]) > 1e-3).any()
    assert len(result.report.regions) == 3


@pytest.mark.parametrize("options", [{}, {"conserve_volume": True}, {"boundary": "free"}], ids=str)
def test_an_interface_through_cells_of_all_types(options):
    mesh = jittered_inside(mixed_block(2), 0.15, seed=11)
    points = mesh.points.copy()
    points[mixed_block(2).points[:, 1] == 1.0, 1] = 1.0
    beyond = points[collapsed_mesh(mesh).cells].mean(axis=1)[:, 1] > 1.0
    regions = np.where(beyond, 2, 1)
    result = hc.regularize(MixedMesh(points, mesh.blocks, {}, {"material": regions}), **options)
    (interface,) = result.report.interfaces
    assert interface.quads > 20
    assert interface.distance < 1e-10 if options.get("boundary") != "free" else interface.distance is not None
    assert result.report.after.invalid == 0
    assert len(result.report.regions) == 2
    if "conserve_volume" in options:
        for row in result.report.regions:
            assert row.volume_after == pytest.approx(row.volume_before, rel=1e-9)


def test_tagged_triangles_of_the_boundary_keep_their_outline():
    mesh = jittered_inside(mixed_block(2), 0.1, seed=8)
    top = mesh.points[:, 2] == 2.0
    quads, _ = boundary_quads(collapsed_mesh(mesh).cells)
    skin = quads[(quads[:, 2] == quads[:, 3]) & top[quads].all(axis=1)][:, :3]
    assert len(skin) > 4
    half = mesh.points[skin].mean(axis=1)[:, 1] < 1.0
    cells = [(block.cell_type.name, block.cells) for block in mesh.blocks]
    tags = [np.zeros(len(block.cells), int) for block in mesh.blocks]
    source = meshio.Mesh(mesh.points, [*cells, ("triangle", skin)], cell_data={"gmsh:physical": [*tags, 1 + half]})
    result = hc.regularize(source)
    assert any("outlines on the boundary are kept" in note for note in result.report.notes)
    line = np.intersect1d(skin[half], skin[~half])
    line = line[np.argsort(mesh.points[line, 0])]
    inside = line[1:-1]
    old, new = mesh.points[line], result.points[inside]
    # Along the polyline that it was, within the band of curves; across it nodes on faces go where they like.
    across = np.interp(new[:, 0], old[:, 0], old[:, 1])
    band = 0.2 * 0.005 * np.linalg.norm(np.ptp(mesh.points, axis=0))
    assert np.abs(new[:, 1] - across).max() < 2.0 * band
    assert (np.abs(new[:, 0] - mesh.points[inside, 0]) > band).any()


def test_hexahedra_with_coinciding_nodes_are_worked_on_as_what_they_are():
    mesh = jittered_inside(mixed_block(2), 0.3, seed=9)
    blocks = {block.cell_type.name: block.cells for block in mesh.blocks}
    as_hexahedra = collapsed_cells(blocks.pop("wedge"), WEDGE)[:, [3, 0, 1, 2, 7, 4, 5, 6]]
    grid = meshio.Mesh(
        mesh.points,
        [("hexahedron", np.concatenate([blocks.pop("hexahedron"), as_hexahedra])), *blocks.items()],
    )
    result = hc.regularize(grid)
    assert result.report.after.types["wedge"].count == len(as_hexahedra)
    assert result.report.after.invalid == 0
    np.testing.assert_array_equal(result.mesh.cells[0].data, grid.cells[0].data)
    np.testing.assert_allclose(result.points, hc.regularize(mesh).points, atol=1e-12)


def test_what_other_types_cannot_do_is_said():
    mesh = mixed_block(2)
    for options in ({"energy": "quaternionic"}, {"quadrature": "gauss"}):
        with pytest.raises(OptionError, match="other types than hexahedra"):
            hc.regularize(mesh, **options)
    with pytest.raises(OptionError, match="not be one box where there are other cells than hexahedra, 204 here"):
        hc.regularize(mesh, target="1:1:2")


def test_against_their_own_shapes_cells_stay_and_against_those_of_another_mesh_they_become_these():
    ideal = mixed_block(3)
    mesh = jittered_inside(ideal, 0.12, seed=1)
    np.testing.assert_array_equal(hc.regularize(mesh, target="input").points, mesh.points)
    before, result = np.abs(mesh.points - ideal.points), hc.regularize(mesh, target=ideal.points)
    assert np.abs(result.points - ideal.points).mean() < 0.2 * before.mean()
    own, after = minima(ideal), minima(result.mesh)
    assert all(after[name] > 0.95 * own[name] for name in NAMES), (after, own)


def test_a_report_tells_of_every_type():
    report = hc.regularize(jittered_inside(mixed_block(2), 0.2, seed=10)).report
    text = str(report)
    for plural in ("hexahedra", "wedges", "pyramids", "tetrahedra"):
        assert any(line.startswith(f"{plural}, scaled jac. min") for line in text.splitlines())
    assert set(report.to_dict()["after"]["types"]) == set(NAMES)


@pytest.mark.parametrize(
    "options",
    [
        {"constraint": "compatible"},
        {"conserve_volume": True},
        {"weight": "volume"},
        {"method": "lbfgs"},
        {"method": "newton"},
        {"features": "soft"},
        {"hausdorff": 0.0},
        {"hausdorff": 0.05},
        {"emphasis": "mean"},
        {"sizes": "free"},
        {"max_iterations": 2},
        {"boundary": "free"},
    ],
    ids=str,
)
def test_options_do_what_they_say(options):
    mesh = jittered_inside(mixed_block(2), 0.15, seed=3)
    before, report = minima(mesh), hc.regularize(mesh, **options).report
    assert report.after.invalid == 0
    assert report.after.shape.mean > report.before.shape.mean
    if options.get("emphasis") != "mean":
        assert all(report.after.types[name].scaled_jacobian.min >= before[name] - 1e-6 for name in NAMES)
    if options.get("boundary") != "free":
        assert report.hausdorff <= options.get("hausdorff", 0.005)
    if "conserve_volume" in options:
        assert abs(report.volume_change) < 1e-10
    if "max_iterations" in options:
        assert report.iterations <= 2


def test_layers_of_wedges_and_hexahedra_stay_thin():
    points, cells = box((6, 6, 6), (6.0, 6.0, 0.9))
    one_side = points[cells].mean(axis=1)[:, 0] > 3.0
    wedges = np.concatenate([cells[one_side][:, [0, 1, 2, 4, 5, 6]], cells[one_side][:, [0, 2, 3, 4, 6, 7]]])
    mesh = jittered_inside(MixedMesh.of_types(points, {"hexahedron": cells[~one_side], "wedge": wedges}), 0.03, 1)
    result = hc.regularize(mesh)
    assert result.report.after.invalid == 0
    assert any("stretched in the input" in note for note in result.report.notes)
    for block in blocks_of(result.mesh):
        half = block.cells.shape[1] // 2
        heights = result.points[block.cells[:, half:], 2] - result.points[block.cells[:, :half], 2]
        assert heights.min() > 0.1
        assert heights.max() < 0.2
    assert min(minima(result.mesh).values()) > 0.75


@pytest.mark.skipif(not SHARED.is_dir(), reason="the shared meshes are not here")
@pytest.mark.parametrize(
    ("name", "least"),
    [("elements/hexpyrtet_tangled", {"tetra": 0.2, "hexahedron": 0.88, "pyramid": 0.44})],
)
def test_meshes_of_others_become_valid(name, least):
    after = minima(hc.regularize(SHARED / "meshes" / f"{name}.vtu").mesh)
    assert all(after[kind] >= bound for kind, bound in least.items()), after


@pytest.mark.long
@pytest.mark.skipif(not SHARED.is_dir(), reason="the shared meshes are not here")
@pytest.mark.parametrize("name", ["febio_fl17", "hexsmoothing", "msq_hex_pyr_tet", "notch_stress"])
def test_no_type_of_meshes_of_others_gets_worse(name):
    path = SHARED / "meshes" / "hex2" / f"mixed_{name}_input.vtu"
    before, result = minima(path), hc.regularize(path)
    after = minima(result.mesh)
    assert result.report.after.invalid == 0
    assert all(after[kind] >= before[kind] - 1e-6 for kind in before), (before, after)
