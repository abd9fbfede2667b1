"""find_simplex against long integers: faces, edges, vertices, shapes."""
import numpy as np
import pytest
import scipy.spatial

import incode


def exact(array):
    """Multiples of 2^-60 as integers."""
    scaled = [int(x * 2.0**60) for x in array.ravel()]
    assert all(n == x * 2.0**60 for n, x in zip(scaled, array.ravel()))
    return np.array(scaled, object).reshape(array.shape)


def determinant(a, b, c):
    return (
        a[:, 0] * (b[:, 1] * c[:, 2] - b[:, 2] * c[:, 1])
        - a[:, 1] * (b[:, 0] * c[:, 2] - b[:, 2] * c[:, 0])
        + a[:, 2] * (b[:, 0] * c[:, 1] - b[:, 1] * c[:, 0])
    )


def lowest(points, simplices, query):
    """The first simplex that has no negative coordinate of the query."""
    v = points[simplices] - query
    holds = np.ones(len(simplices), bool)
    for i in range(4):
        # The simplex with the query, the origin, for vertex i is not inverted.
        a, b, c = (v[:, j] for j in range(4) if j != i)
        sign = determinant(a, b, c) * (1, -1, 1, -1)[i]
        holds &= (sign >= 0).astype(bool)
    return int(np.argmax(holds)) if holds.any() else -1


def queries_on(rng, points, simplices):
    """Vertices, midpoints of edges, points of facets, insides, others."""
    v = points[simplices[rng.integers(len(simplices), size=8)]]
    outside = (
        points.max(0)
        + rng.integers(0, 2, (8, 3)) * [0.25, 0, 0.5]
        - [0, 0.25, 0]
    )
    return np.concatenate(
        [
            v[:, 0],
            (v[:, 1] + v[:, 3]) / 2,
            (2 * v[:, 1] + v[:, 2] + v[:, 3]) / 4,
            v.sum(1) / 4,
            outside,
            rng.integers(0, 9, (16, 3)) / 8,
        ]
    )


@pytest.mark.parametrize(
    "make",
    [
        lambda rng: rng.random((60, 3)),
        lambda rng: rng.integers(0, 9, (80, 3)) / 8,
        lambda rng: np.mgrid[0:4, 0:4, 0:4].reshape(3, -1).T / 4.0,
    ],
    ids=["general", "lattice with duplicates", "grid"],
)
@pytest.mark.parametrize("threads", [1, 3])
def test_exact(rng, make, threads):
    points = make(rng)
    tri = incode.Delaunay(points, threads=threads)
    queries = queries_on(rng, points, tri.simplices)
    expected = [lowest(exact(points), tri.simplices, q) for q in exact(queries)]
    assert tri.find_simplex(queries).tolist() == expected
    assert [int(tri.find_simplex(q)) for q in queries] == expected
    assert -1 in expected and max(expected) >= 0


def test_vertices_are_in_their_lowest_simplex(rng):
    points = rng.random((3000, 3))
    tri = incode.Delaunay(points)
    assert (tri.find_simplex(points) == tri.vertex_to_simplex).all()


def test_shapes(rng):
    tri = incode.Delaunay(rng.random((100, 3)))
    for shape in [(3,), (0, 3), (1, 3), (2, 5, 3), (2, 0, 3), (4, 1, 2, 3)]:
        xi = rng.random(shape)
        found = tri.find_simplex(xi)
        assert isinstance(found, np.ndarray) and found.shape == shape[:-1]
        assert found.dtype == np.int64
        theirs = scipy.spatial.Delaunay(tri.points).find_simplex(xi)
        assert found.shape == theirs.shape
    assert tri.find_simplex([0.5, 0.5, 0.5]) == tri.find_simplex(
        (0.5, 0.5, 0.5), True, 1e-9
    )
    assert tri.find_simplex([5, 5, 5], bruteforce=True, tol=100.0) == -1


@pytest.mark.parametrize("count", [3, 5000])
def test_not_finite(rng, count):
    tri = incode.Delaunay(rng.random((100, 3)))
    xi = rng.random((count, 3))
    expected = tri.find_simplex(xi)
    xi[[0, 2], [1, 2]] = np.nan, np.inf
    expected[[0, 2]] = -1
    assert (tri.find_simplex(xi) == expected).all()
    assert tri.find_simplex([np.nan, 0, 0]) == -1


@pytest.mark.parametrize(
    "xi", [1.0, [], [1, 2], np.zeros((3, 2)), np.zeros((3, 4, 2))]
)
def test_wrong_shapes(rng, xi):
    tri = incode.Delaunay(rng.random((10, 3)))
    with pytest.raises(ValueError, match="xi has the shape"):
        tri.find_simplex(xi)


def test_threads_agree(rng):
    points, queries = rng.random((20000, 3)), rng.random((50000, 3))
    found = [
        incode.Delaunay(points, threads=n).find_simplex(queries)
        for n in (1, 2, 5)
    ]
    assert (found[0] == found[1]).all() and (found[0] == found[2]).all()
