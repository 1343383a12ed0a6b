"""Edges of faces, each of them once, and connected pieces of a graph."""

import numpy as np

from hexconformal.mesh.edges import face_edges, unique_edges
from hexconformal.mesh.topology import connected_components


def test_edges_are_those_of_sorting_pairs():
    faces = np.random.default_rng(0).permuted(np.tile(np.arange(9), (40, 1)), axis=1)[:, :4]
    pairs = face_edges(faces)
    edges = unique_edges(pairs)
    nodes, first, inverse, counts = np.unique(
        np.sort(pairs, axis=1), axis=0, return_index=True, return_inverse=True, return_counts=True
    )
    np.testing.assert_array_equal(edges.nodes, nodes)
    np.testing.assert_array_equal(edges.first, first)
    np.testing.assert_array_equal(edges.of_pairs, inverse.ravel())
    np.testing.assert_array_equal(edges.counts, counts)
    assert unique_edges(np.empty((0, 2), dtype=np.int64)).nodes.shape == (0, 2)


def test_pieces_are_numbered_by_first_appearance_however_the_edges_run():
    pairs = np.array([[7, 2], [5, 9], [2, 4], [9, 1], [5, 9], [3, 3]])
    for some in (pairs, pairs[::-1], pairs[:, ::-1]):
        assert connected_components(some, 10).tolist() == [0, 1, 2, 3, 2, 1, 4, 2, 5, 1]
    assert connected_components(np.empty((0, 2), dtype=np.int64), 3).tolist() == [0, 1, 2]
