"""incode.Delaunay against scipy's, against digests, with each kind of array."""
import copy
import fractions
import gc
import hashlib
import os
import pickle

import numpy as np
import pytest
import scipy.spatial

import incode


def as_set(rows):
    return np.unique(np.sort(rows, axis=1), axis=0)


def equal_sets(a, b):
    a, b = as_set(a), as_set(b)
    return a.shape == b.shape and bool((a == b).all())


def clustered(rng, n):
    return rng.normal(size=(n, 3)) * 10.0 ** rng.integers(-2, 3, (n, 1))


def on_sphere(rng, n):
    p = rng.normal(size=(n, 3))
    return (
        p / np.linalg.norm(p, axis=1)[:, None] * rng.uniform(0.9, 1.1, (n, 1))
    )


@pytest.mark.parametrize(
    "make",
    [
        lambda rng: rng.random((4, 3)),
        lambda rng: rng.random((5000, 3)),
        lambda rng: clustered(rng, 2000),
        lambda rng: on_sphere(rng, 2000),
        lambda rng: rng.normal(size=(3000, 3)) * [1, 30, 1000] + 1e4,
    ],
    ids=["four", "uniform", "clustered", "shell", "stretched"],
)
def test_like_scipy(rng, make):
    points = make(rng)
    ours, theirs = incode.Delaunay(points), scipy.spatial.Delaunay(points)
    assert equal_sets(ours.simplices, theirs.simplices)
    assert equal_sets(ours.convex_hull, theirs.convex_hull)
    for name in ("npoints", "nsimplex", "ndim"):
        assert getattr(ours, name) == getattr(theirs, name)
    for name in ("points", "min_bound", "max_bound"):
        assert (getattr(ours, name) == getattr(theirs, name)).all()
    assert ours.coplanar.shape == theirs.coplanar.shape == (0, 3)
    for name in ("simplices", "convex_hull"):
        assert getattr(ours, name).dtype == getattr(theirs, name).dtype
    a, b = ours.vertex_neighbor_vertices, theirs.vertex_neighbor_vertices
    assert (a[0] == b[0]).all()
    for k in range(0, len(points), 97):
        assert (
            a[1][a[0][k] : a[0][k + 1]] == np.sort(b[1][b[0][k] : b[0][k + 1]])
        ).all()
    queries = rng.uniform(points.min(0) - 0.1, points.max(0) + 0.1, (2000, 3))
    i, j = ours.find_simplex(queries), theirs.find_simplex(queries)
    assert ((i < 0) == (j < 0)).all()
    assert (
        np.sort(ours.simplices[i[i >= 0]], 1)
        == np.sort(theirs.simplices[j[i >= 0]], 1)
    ).all()


def test_neighbors_as_scipy_defines(rng):
    tri = incode.Delaunay(rng.random((500, 3)))
    assert tri.neighbors.min() == -1 and tri.neighbors.max() < tri.nsimplex
    assert (tri.neighbors == -1).sum() == len(tri.convex_hull)
    for k, row in enumerate(tri.simplices):
        for i, other in enumerate(tri.neighbors[k]):
            face = set(row) - {row[i]}
            if other >= 0:
                assert (
                    face < set(tri.simplices[other])
                    and k in tri.neighbors[other]
                )


def test_orientation(rng):
    points = rng.random((500, 3))
    tri = incode.Delaunay(points)
    v = points[tri.simplices]
    assert (np.linalg.det(v[:, 1:] - v[:, :1]) > 0).all()
    h = points[tri.convex_hull]
    normal = np.cross(h[:, 1] - h[:, 0], h[:, 2] - h[:, 0])
    assert (((h[:, 0] - points.mean(0)) * normal).sum(1) > 0).all()


def test_transform(rng):
    points = rng.random((500, 3))
    tri, xi = incode.Delaunay(points), rng.random((500, 3))
    theirs = scipy.spatial.Delaunay(points)
    assert tri.transform.shape == theirs.transform.shape
    found = tri.find_simplex(xi)
    xi, found = xi[found >= 0], found[found >= 0]
    maps = tri.transform[found]
    weights = np.einsum("nij,nj->ni", maps[:, :3], xi - maps[:, 3])
    weights = np.c_[weights, 1 - weights.sum(1)]
    assert weights.min() > -1e-9
    corners = points[tri.simplices[found]]
    assert np.allclose((corners * weights[:, :, None]).sum(1), xi, atol=1e-9)


@pytest.mark.filterwarnings("error")
def test_transform_of_what_is_flat_in_float64():
    points = np.vstack([np.zeros(3), np.eye(3), [[2, 0, 1]]])
    for scale in ([1, 1, 5e-324], [1e-120] * 3):
        maps = incode.Delaunay(points * scale).transform
        assert len(maps) == 2 and np.isnan(maps[:, :3]).all()
        assert not np.isnan(maps[:, 3]).any()


def sets():
    path = os.environ.get("INCODE_SETS", os.devnull)
    with open(path, encoding="utf-8") as lines:
        return [line.split() for line in lines]


@pytest.mark.parametrize(
    "name, path, points, tetrahedra, digest",
    [pytest.param(*s, id=s[0]) for s in sets()],
)
def test_digest(name, path, points, tetrahedra, digest):
    array = incode.read(path)
    assert array.shape == (int(points), 3)
    if int(tetrahedra) == 0:
        with pytest.raises(ValueError, match="plane"):
            incode.Delaunay(array)
        return
    rows = np.sort(incode.Delaunay(array).simplices, axis=1).astype("<u4")
    rows = rows[np.lexsort(rows.T[::-1])]
    assert len(rows) == int(tetrahedra)
    assert hashlib.sha256(rows.tobytes()).hexdigest() == digest


# --- arrays -------------------------------------------------------------------

POINTS = (
    np.random.default_rng(2).integers(-500, 500, (300, 3)).astype(np.float64)
)


def mapped(folder):
    np.save(folder / "points.npy", POINTS)
    return np.load(folder / "points.npy", mmap_mode="r")


def read_only(_):
    array = POINTS.copy()
    array.flags.writeable = False
    return array


def unaligned(_):
    packed = np.zeros(len(POINTS), np.dtype([("tag", "u1"), ("at", "f8", 3)]))
    packed["at"] = POINTS
    return packed["at"]


def unaligned_contiguous(_):
    return (
        np.frombuffer(b"x" + POINTS.tobytes(), np.uint8)[1:]
        .view(np.float64)
        .reshape(-1, 3)
    )


LAYOUTS = {
    "float64": lambda _: POINTS,
    "float32": lambda _: POINTS.astype("f4"),
    "float16": lambda _: POINTS.astype("f2"),
    "longdouble": lambda _: POINTS.astype("g"),
    "int16": lambda _: POINTS.astype("i2"),
    "int64": lambda _: POINTS.astype("i8"),
    "big endian": lambda _: POINTS.astype(">f8"),
    "big int": lambda _: POINTS.astype(">i4"),
    "fortran": lambda _: np.asfortranarray(POINTS),
    "list": lambda _: POINTS.tolist(),
    "tuples": lambda _: tuple(map(tuple, POINTS)),
    "read-only": read_only,
    "mapped": mapped,
    "columns": lambda _: np.repeat(POINTS, 2, axis=1)[:, ::2],
    "rows": lambda _: np.repeat(POINTS, 2, axis=0)[::2],
    "reversed": lambda _: POINTS[::-1, ::-1].copy()[::-1, ::-1],
    "matrix": lambda _: np.asmatrix(POINTS),
    "unaligned": unaligned,
    "unaligned, contiguous": unaligned_contiguous,
    "fractions": lambda _: [
        [fractions.Fraction(x) for x in row] for row in POINTS.tolist()
    ],
    "memoryview": lambda _: memoryview(POINTS),
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_layout(layout, tmp_path):
    tri = incode.Delaunay(LAYOUTS[layout](tmp_path))
    expected = incode.Delaunay(POINTS.copy())
    assert tri.points.dtype == np.float64 and tri.points.flags.aligned
    assert (tri.points == POINTS).all()
    assert (tri.simplices == expected.simplices).all()
    assert (
        tri.find_simplex(LAYOUTS[layout](tmp_path))
        == expected.find_simplex(POINTS)
    ).all()


@pytest.mark.parametrize("layout", ["float64", "read-only", "mapped"])
def test_in_place(layout, tmp_path):
    given = LAYOUTS[layout](tmp_path)
    assert np.shares_memory(incode.Delaunay(given).points, given)


def test_input_is_not_written(rng):
    points = rng.random((500, 3))
    points[0] = -0.0
    before = points.tobytes()
    incode.Delaunay(points).find_simplex(points)
    assert points.tobytes() == before


# --- duplicates ---------------------------------------------------------------


def test_duplicates(rng):
    points = np.concatenate([rng.random((50, 3)), np.zeros((1, 3))])
    points = np.concatenate([points, points[[7, 3, 7]], -points[50:]])
    tri = incode.Delaunay(points)
    assert sorted(map(tuple, tri.coplanar[:, ::2])) == [
        (51, 7),
        (52, 3),
        (53, 7),
        (54, 50),
    ]
    for row, simplex, vertex in tri.coplanar:
        assert vertex in tri.simplices[simplex]
        assert not (tri.simplices[:simplex] == vertex).any()
        assert (
            tri.vertex_to_simplex[vertex] == simplex
            and tri.vertex_to_simplex[row] == -1
        )
        indptr, _ = tri.vertex_neighbor_vertices
        assert (
            indptr[row] == indptr[row + 1]
            and indptr[vertex] < indptr[vertex + 1]
        )
    assert set(tri.simplices.ravel()) == set(range(51))
    theirs = scipy.spatial.Delaunay(points[:54])
    lowest = np.arange(54)
    lowest[51:] = 7, 3, 7  # Qhull may keep another row of a point
    assert len(theirs.coplanar) == 3
    assert equal_sets(tri.simplices, lowest[theirs.simplices])


# --- memory -------------------------------------------------------------------


def test_views_outlive_the_object(rng):
    points = rng.random((20000, 3))
    tri = incode.Delaunay(points)
    names = ("simplices", "neighbors", "convex_hull")
    copies = [getattr(tri, name).copy() for name in names]
    views = [getattr(tri, name) for name in names]
    indptr, indices = tri.vertex_neighbor_vertices
    views += [indptr[:5], indices[10:][::2]]
    copies += [indptr[:5].copy(), indices[10:][::2].copy()]
    del tri, indptr, indices
    gc.collect()
    other = [incode.Delaunay(rng.random((20000, 3))) for _ in range(3)]
    assert all((view == copy).all() for view, copy in zip(views, copies))
    del other


def test_results_are_read_only(rng):
    tri = incode.Delaunay(rng.random((50, 3)))
    for array in (
        tri.simplices,
        tri.neighbors,
        tri.convex_hull,
        *tri.vertex_neighbor_vertices,
    ):
        assert not array.flags.writeable and not array.flags.owndata
        with pytest.raises(ValueError):
            array[0] = 0


def resident():
    with open("/proc/self/status", encoding="ascii") as lines:
        return (
            next(
                int(line.split()[1])
                for line in lines
                if line.startswith("VmRSS")
            )
            << 10
        )


def test_memory_is_freed(rng):
    points = rng.random((5000, 3))

    def use():
        tri = incode.Delaunay(points)
        tri.find_simplex(points)
        return (
            tri.simplices.nbytes
            + tri.neighbors.nbytes
            + tri.vertex_neighbor_vertices[1].nbytes
        )

    for _ in range(5):
        size = use()
    gc.collect()
    before = resident()
    for _ in range(100):
        use()
    gc.collect()
    # One that stays of ten is found.
    assert resident() - before < 10 * size


@pytest.mark.parametrize(
    "again",
    [copy.copy, copy.deepcopy, lambda tri: pickle.loads(pickle.dumps(tri))],
    ids=["copy", "deepcopy", "pickle"],
)
def test_copies_and_pickles(rng, again):
    tri = incode.Delaunay(rng.random((500, 3)), threads=2)
    other = again(tri)
    assert (other.points == tri.points).all()
    assert (other.simplices == tri.simplices).all()
    assert (other.find_simplex(tri.points) == tri.vertex_to_simplex).all()
