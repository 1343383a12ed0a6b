"""What files say of nodes that move together: $Periodic of Gmsh, *EQUATION and *MPC of decks."""

import numpy as np
import pytest
from io_decks import read
from meshes.coupled import QUARTER, gaps, periodic_box, sector

import hexconformal as hc
from hexconformal.mesh import find_couplings


def gmsh_text(version, points, cells, links):
    """A file of Gmsh with links (dimension, affine or None, pairs) in its $Periodic."""
    nodes = [f"{k} {x!r} {y!r} {z!r}" for k, (x, y, z) in enumerate(points.tolist(), 1)]
    rows = [" ".join(map(str, row)) for row in (cells + 1).tolist()]
    lines = ["$MeshFormat", f"{version} 0 8", "$EndMeshFormat"]
    if version == "4.1":
        n, m = len(nodes), len(rows)
        places = [line.split(" ", 1)[1] for line in nodes]
        lines += ["$Nodes", f"1 {n} 1 {n}", f"3 1 0 {n}", *map(str, range(1, n + 1)), *places, "$EndNodes"]
        elements = [f"{k} {row}" for k, row in enumerate(rows, 1)]
        lines += ["$Elements", f"1 {m} 1 {m}", f"3 1 5 {m}", *elements, "$EndElements"]
    else:
        lines += ["$Nodes", str(len(nodes)), *nodes, "$EndNodes", "$Elements", str(len(rows))]
        lines += [*(f"{k} 5 2 1 1 {row}" for k, row in enumerate(rows, 1)), "$EndElements"]
    lines += ["$Periodic", str(len(links))]
    for dimension, affine, pairs in links:
        numbers = "" if affine is None else " ".join(repr(float(x)) for x in np.ravel(affine))
        lines.append(f"{dimension} 2 1")
        if version == "4.1":
            lines.append("0" if affine is None else f"16 {numbers}")
        elif affine is not None:
            lines.append(f"Affine {numbers}")
        lines += [str(len(pairs)), *(f"{first + 1} {second + 1}" for first, second in pairs.tolist())]
    return "\n".join([*lines, "$EndPeriodic", ""])


def affine(rotation, shift):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, shift
    return matrix


@pytest.mark.parametrize("told", [True, False])
@pytest.mark.parametrize("version", ["2.2", "4.1"])
def test_periodic_faces_of_gmsh_are_kept_and_written_again(tmp_path, version, told):
    points, cells, pairs = periodic_box((3, 3, 3), 0.15)
    thirds = np.split(pairs, 3)
    links = [(2, affine(np.eye(3), np.eye(3)[k]) if told else None, thirds[k]) for k in range(3)]
    # Links of edges and corners repeat what those of faces say.
    links = [(0, None, thirds[1][:1]), (1, None, thirds[0][:4]), *links]
    (tmp_path / "cell.msh").write_text(gmsh_text(version, points, cells, links))
    mesh = hc.read(tmp_path / "cell.msh")
    result = hc.regularize(mesh, boundary="free")
    assert "couplings: 48 pairs of nodes move together ($Periodic)" in result.report.notes
    assert np.abs(gaps(result.points, pairs) - gaps(points, pairs)).max() < 1e-14
    assert result.report.after.scaled_jacobian.min > 0.99
    hc.write(tmp_path / "better.msh", result.mesh)
    again = hc.read(tmp_path / "better.msh")
    assert len(find_couplings(again).pairs) == 48
    ignored = hc.regularize(mesh, boundary="free", couplings="ignore")
    assert np.abs(gaps(ignored.points, pairs) - gaps(points, pairs)).max() > 1e-3


@pytest.mark.parametrize("told", [True, False])
@pytest.mark.parametrize("version", ["2.2", "4.1"])
def test_a_sector_of_gmsh_is_kept(tmp_path, version, told):
    points, cells, pairs = sector((3, 4, 3), 0.2)
    links = [(2, affine(QUARTER, np.zeros(3)) if told else None, pairs)]
    (tmp_path / "ring.msh").write_text(gmsh_text(version, points, cells, links))
    result = hc.regularize(tmp_path / "ring.msh")
    assert "couplings: 16 pairs of nodes move together ($Periodic)" in result.report.notes
    assert np.abs(gaps(result.points, pairs, QUARTER)).max() < 1e-14


def test_pairs_of_gmsh_that_do_not_face_each_other_are_told_and_not_kept(tmp_path):
    points, cells, pairs = periodic_box((3, 3, 3), 0.15)
    thirds = np.split(pairs, 3)
    points[thirds[0][5, 0]] += 0.01
    links = [(2, affine(np.eye(3), np.eye(3)[k]), thirds[k]) for k in range(3)]
    (tmp_path / "cell.msh").write_text(gmsh_text("4.1", points, cells, links))
    notes = find_couplings(hc.read(tmp_path / "cell.msh")).notes
    first, second = thirds[0][5] + 1
    assert len(notes) == 2
    assert notes[0] == "couplings: 32 pairs of nodes move together ($Periodic)"
    assert notes[1].startswith("couplings: 16 pairs of nodes of $Periodic are not kept")
    assert f"nodes {first} and {second} are off by 0.00" in notes[1]


def deck(points, cells, statements):
    nodes = "".join(f"{k}, {x!r}, {y!r}, {z!r}\n" for k, (x, y, z) in enumerate(points.tolist(), 1))
    bricks = "".join(f"{k}, {', '.join(map(str, row))}\n" for k, row in enumerate((cells + 1).tolist(), 1))
    return f"*NODE\n{nodes}*ELEMENT, TYPE=C3D8\n{bricks}{statements}"


def equations(pairs, reference=None, freedoms=(1, 2, 3)):
    text = ""
    for first, second in (pairs + 1).tolist():
        for freedom in freedoms:
            more = "" if reference is None else f", {reference}, {freedom}, -1."
            text += (
                f"*EQUATION\n{2 if reference is None else 3}\n{first}, {freedom}, 1., {second}, {freedom}, -1.{more}\n"
            )
    return text


@pytest.mark.parametrize("reference", [None, 65])
def test_equations_of_two_nodes_couple_them(tmp_path, reference):
    points, cells, pairs = periodic_box((3, 3, 3), 0.15)
    points = np.concatenate([points, [[5.0, 5.0, 5.0]]])
    mesh = read(tmp_path, deck(points, cells, equations(pairs, reference)))
    result = hc.regularize(mesh, boundary="free")
    assert "couplings: 48 pairs of nodes move together (*EQUATION)" in result.report.notes
    assert np.abs(gaps(result.points, pairs) - gaps(points, pairs)).max() < 1e-14
    assert result.report.after.scaled_jacobian.min > 0.99


def test_equations_may_stand_in_one_section_and_go_on_in_the_next_line_and_name_sets(tmp_path):
    points, cells, _ = periodic_box((2, 2, 2), 0.1)
    text = "*NSET, NSET=LEFT\n1\n*NSET, NSET=RIGHT\n3\n*EQUATION\n"
    for freedom in (1, 2, 3):
        text += f"3\nRIGHT, {freedom}, 2., LEFT, {freedom}, -2.,\n 28, {freedom}, 1.\n"
        text += f"2\n6, {freedom}, -1.\n4, {freedom}, 1.\n"
    points = np.concatenate([points, [[5.0, 5.0, 5.0]]])
    found = find_couplings(read(tmp_path, deck(points, cells, text)))
    np.testing.assert_array_equal(found.pairs, [[2, 0], [5, 3]])


def test_tie_and_pin_couple_two_nodes(tmp_path):
    points, cells, pairs = periodic_box((2, 2, 2), 0.1)
    lines = "".join(
        f"{kind}, {a + 1}, {b + 1}\n" for kind, (a, b) in zip(["TIE", "pin"] * 14, pairs.tolist(), strict=False)
    )
    found = find_couplings(read(tmp_path, deck(points, cells, f"*MPC\n{lines}")))
    assert found.counts == {"*MPC": 27}


@pytest.mark.parametrize(
    ("statement", "told"),
    [
        ("*EQUATION\n2\n3, 1, 1., 1, 1, -1.\n", "1 *EQUATION"),  # one direction alone
        (equations(np.array([[2, 0]])).replace("-1.", "-0.5"), "3 *EQUATION"),
        ("*EQUATION\n3\n3, 1, 1., 1, 1, -0.5, 5, 1, -0.5\n", "1 *EQUATION"),
        ("*EQUATION\n2\n3, 1, 1., 1, 2, -1.\n", "1 *EQUATION"),
        ("*EQUATION\n2\n3, 1, 1., 999, 1, -1.\n", "1 *EQUATION"),
        ("*EQUATION\n900000000\n3, 1, 1., 1, 1, -1.\n", "1 *EQUATION"),
        ("*EQUATION\nnone\n", "1 *EQUATION"),
        ("*EQUATION, INPUT=there.txt\n", "1 *EQUATION"),
        ("*MPC\nBEAM, 3, 1\n", "1 *MPC"),
        ("*TIE, NAME=glue\nA, B\n", "1 *TIE"),
    ],
)
def test_what_is_not_understood_is_told(tmp_path, statement, told):
    points, cells, _ = periodic_box((2, 2, 2), 0.1)
    mesh = read(tmp_path, deck(points, cells, statement))
    found = find_couplings(mesh)
    assert len(found.pairs) == 0
    assert found.notes == (f"couplings: not understood, and not kept: {told}",)
    assert find_couplings(mesh, "ignore").notes == ()


def test_equations_of_an_assembly_name_nodes_of_instances(tmp_path):
    points, cells, _ = periodic_box((2, 2, 2), 0.1)
    part = deck(points, cells, "")
    text = f"*PART, NAME=P\n{part}*END PART\n*ASSEMBLY, NAME=A\n"
    text += "*INSTANCE, NAME=I1, PART=P\n*END INSTANCE\n*INSTANCE, NAME=I2, PART=P\n5., 0., 0.\n*END INSTANCE\n"
    text += "*NSET, NSET=ONE, INSTANCE=I2\n3\n"
    for freedom in (1, 2, 3):
        text += f"*EQUATION\n2\nONE, {freedom}, 1., I2.1, {freedom}, -1.\n"
    found = find_couplings(read(tmp_path, text + "*END ASSEMBLY\n"))
    np.testing.assert_array_equal(found.pairs, [[27 + 2, 27]])
