"""Encoding, histograms, and that the packed viewer is that of its sources."""

import hashlib
import re

import numpy as np
import pytest
from paths import ROOT
from web_pages import PageFile

from hexconformal import HexMesh, MeshError, ReadError
from hexconformal.generate import box
from hexconformal.page import Measure, PageSchedule, SeriesReader, thinned
from hexconformal.page.array_store import ArrayStore
from hexconformal.page.document import document
from hexconformal.page.histograms import histogram_of

ROOM = ROOT / "src" / "hexconformal" / "page"


def sources(folder, endings):
    """Our own files, without the packages that are installed to pack them."""
    found = (path for path in folder.rglob("*") if "node_modules" not in path.parts)
    return [path for path in found if path.suffix in endings]


@pytest.mark.parametrize(
    ("values", "kind"),
    [
        (np.random.default_rng(0).normal(size=(50, 3)) * 1e-300, "float64"),
        (np.array([np.nan, np.inf, -np.inf, -0.0, 5e-324]), "float64"),
        (np.arange(12, dtype=np.float32).reshape(3, 4) / 7, "float32"),
        (np.array([0, 255]), "uint8"),
        (np.array([-1, 5]), "int16"),
        (np.array([[2**31 - 1], [-(2**31)]]), "int32"),
        (np.array([2**53]), "float64"),
        (np.array([True, False]), "uint8"),
        (np.empty((0, 5), np.int64), "uint8"),
        (np.asfortranarray(np.arange(6.0).reshape(2, 3)), "float64"),
    ],
    ids=str,
)
def test_arrays_come_back_as_they_were(values, kind):
    store = ArrayStore()
    reference = store.put(values)
    assert reference["type"] == kind
    found = PageFile(document("", {}, store.texts)).array(reference)
    np.testing.assert_array_equal(found, values)
    assert found.shape == values.shape
    if kind.startswith("float") and values.dtype.kind == "f":
        assert found.tobytes() == np.ascontiguousarray(values).tobytes()  # also the sign of zeros
    assert store.put(values.copy()) == reference
    assert len(store.texts) == 1


def test_histograms_count_every_cell():
    values = np.random.default_rng(1).lognormal(sigma=2.0, size=1000)
    values[:3] = np.inf, np.nan, np.inf
    measure = Measure("edge_ratio", "edge ratio", "low", is_ratio=True)
    found = histogram_of(measure, [values, values[:500]], PageSchedule(bins=20))
    assert (sum(found["before"]), sum(found["after"])) == (999, 499)
    assert found["scale"] == "log"
    edges = np.array(found["edges"])
    inside = values[np.isfinite(values)]
    for k in (0, 7, 18):
        assert found["before"][k] == ((inside >= edges[k]) & (inside < edges[k + 1])).sum()
    assert found["before"][-1] == (inside >= edges[-2]).sum() + 2
    assert histogram_of(measure, [np.full(3, np.nan)], PageSchedule()) is None
    same = histogram_of(measure, [np.ones(4)], PageSchedule())
    assert sum(same["after"]) == 4


def test_frames_are_thinned_evenly():
    assert thinned(range(1, 9), 10, PageSchedule()) == list(range(1, 9))
    assert thinned(range(1, 9), 10, PageSchedule(most_places=45)) == [2, 4, 5, 7]
    assert thinned([], 10, PageSchedule()) == []


def test_the_packed_viewer_is_that_of_its_sources():
    """If not: npm ci && npm run pack, in the folder of the sources."""
    folder = ROOM / "viewer"
    names = [path.relative_to(folder).as_posix() for path in sources(folder, (".js", ".mjs", ".css"))]
    digest = hashlib.sha256()
    for name in sorted([*names, "package-lock.json"]):
        digest.update(f"{name}\n{(folder / name).read_text(encoding='utf-8')}".encode())
    packed = (ROOM / "packed" / "viewer.js").read_text(encoding="utf-8")
    assert packed.splitlines()[0] == f"// sha256 of the sources: {digest.hexdigest()}"


def test_the_packed_viewer_has_the_licence_and_is_small():
    packed = (ROOM / "packed" / "viewer.js").read_text(encoding="utf-8")
    assert "Copyright © 2010-2026 three.js authors" in packed or re.search(r"Copyright .* three\.js authors", packed)
    assert "Permission is hereby granted, free of charge" in packed
    assert '"three": "0.187.0"' in (ROOM / "viewer" / "package.json").read_text(encoding="utf-8")
    assert "With three.js 0.187.0" in packed
    assert len(packed) < 800_000
    assert "</script" not in packed


def test_the_viewer_is_in_small_modules():
    modules = sources(ROOM / "viewer", (".js",))
    assert len(modules) > 20
    for path in modules:
        assert len(path.read_text(encoding="utf-8").splitlines()) <= 350, path.name


def test_frames_of_another_mesh_are_refused():
    points, cells = box((2, 2, 2))
    mesh = HexMesh(points, cells)
    reader = SeriesReader(lambda state: state, lambda mesh: {})
    assert len(reader.frames([(1.0, mesh.replaced(2 * points))], mesh)) == 1
    for other in (HexMesh(*box((3, 2, 2))), HexMesh(points, cells[::-1])):
        with pytest.raises(ReadError, match="cannot show t = 1: it is a frame of another mesh"):
            reader.frames([(1.0, other)], mesh)
    lost = mesh.replaced(np.full_like(points, np.inf))
    with pytest.raises(MeshError, match="t = 1: points with NaN or infinite coordinates: 27"):
        reader.frames([(1.0, lost)], mesh)
