"""incode.Delaunay over the functions of incode.h."""
import operator
from functools import cached_property, partial

import numpy as np

from ._incode import ffi, lib

__version__ = ffi.string(lib.incode_version()).decode()

# Fewer rows or queries take less time than an interrupt matters, and a watched
# call has a thread more.
_WATCHED = 1000

_FLOAT64 = np.dtype(np.float64)

# The exception of each status, and what the caller can do.
_ERRORS = {
    lib.INCODE_NO_MEMORY: (
        MemoryError,
        "free memory, use fewer threads, or call incode.stream",
    ),
    lib.INCODE_BAD_ARGUMENT: (
        ValueError,
        "this is a defect of the package; please report it",
    ),
    lib.INCODE_TOO_FEW: (
        ValueError,
        "a tetrahedron needs four distinct points",
    ),
    lib.INCODE_FLAT: (
        ValueError,
        "points in a plane have a triangulation in 2D only",
    ),
    lib.INCODE_TOO_MANY: (ValueError, "triangulate parts of the points"),
    lib.INCODE_IO: (OSError, "see whether the device is full"),
    lib.INCODE_INTERNAL: (RuntimeError, "please report it with the points"),
}


def _check(status):
    if status == lib.INCODE_CANCELLED:
        raise KeyboardInterrupt
    if status != lib.INCODE_OK:
        kind, advice = _ERRORS.get(status, _ERRORS[lib.INCODE_INTERNAL])
        text = ffi.string(lib.incode_status_text(status)).decode()
        raise kind(f"{text}; {advice}")


class _Call:
    """The options of one call, and how its `progress` failed."""

    def __init__(self, threads, progress, flags=0, watched=True):
        self.progress = progress
        self.error = None
        self.options = ffi.new(
            "struct incode_options *", {"threads": threads, "flags": flags}
        )
        if watched or progress is not None:
            self.handle = ffi.new_handle(self)
            self.options.context = self.handle
            self.options.progress = lib.incode_tick

    def end(self):
        """Raises the error of `progress`, whatever the status is.  Afterwards
        nothing refers to itself: arrays are freed without the collector."""
        self.handle = None
        error, self.error = self.error, None
        if error is not None:
            try:
                raise error
            finally:
                del error


def _failed(kind, error, trace):
    if trace is not None:
        ffi.from_handle(trace.tb_frame.f_locals["context"]).error = error


# The library calls it on the calling thread.  Python handles signals as it
# enters the function: Ctrl-C raises KeyboardInterrupt here.
@ffi.def_extern(error=False, onerror=_failed)
def incode_tick(context, done):
    progress = ffi.from_handle(context).progress
    if progress is not None:
        progress(done)
    return True


class _Memory:
    """Memory of the library as an array: numpy keeps this, this the owner."""

    def __init__(self, owner, pointer, shape, kind):
        self.owner = owner
        self.__array_interface__ = {
            "version": 3,
            "data": (int(ffi.cast("uintptr_t", pointer)), True),
            "shape": shape,
            "typestr": np.dtype(kind).str,
        }


def _view(owner, pointer, shape, kind):
    if shape[0] == 0:
        return np.empty(shape, kind)
    return np.asarray(_Memory(owner, pointer, shape, kind))


def _rows_kind(points):
    """Row numbers as int32, like scipy's, as long as they fit."""
    return np.int32 if points <= 1 << 31 else np.uint32


def _coordinates(given, name):
    """`given` as it is if it is contiguous float64, else converted once."""
    if np.ma.isMaskedArray(given):
        raise ValueError(
            f"{name} of shape {given.shape} is a masked array; give the rows "
            "that are not masked, as an array"
        )
    array = np.asarray(given)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise ValueError(
            f"{name} has the shape {array.shape}; its last axis must be x, y, z"
        )
    if array.dtype.kind == "c":
        raise ValueError(
            f"{name} of shape {array.shape} is complex; give real coordinates"
        )
    try:
        return np.require(array, np.float64, ["C", "A"])
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"{name} of shape {array.shape} and type {array.dtype} does not "
            f"convert to float64: {error}"
        ) from error


def _thread_count(threads):
    threads = operator.index(threads)
    if not 0 <= threads < 1 << 32:
        raise ValueError(
            f"threads={threads}; give a count, or 0 for one on each processor"
        )
    return threads


class Delaunay:
    """The Delaunay tetrahedra of points in space, computed exactly.

    points: array of shape (n, 3).  Contiguous float64 is used in place and must
        not change while this object is in use; anything else is converted once.
    threads: how many work; 0: one for each processor.
    progress: called at least ten times a second with the part that is done, 0.0
        to 1.0.  An exception that it raises ends the call and is passed on.

    simplices, neighbors, convex_hull and vertex_neighbor_vertices are views of
    the library's memory, which is freed with the last of them.  They are
    read-only.
    """

    ndim = 3

    def __init__(self, points, *, threads=0, progress=None):
        points = _coordinates(points, "points")
        if points.ndim != 2:
            raise ValueError(
                f"points has the shape {points.shape}; (n, 3) is needed"
            )
        self.points = points
        self.npoints = n = len(points)
        self._threads = _thread_count(threads)
        self._xyz = ffi.from_buffer("double[]", points)
        call = _Call(
            self._threads,
            progress,
            lib.INCODE_NEIGHBORS | lib.INCODE_HULL,
            n >= _WATCHED,
        )
        result = ffi.new("struct incode_tetrahedra *")
        status = lib.incode_delaunay(self._xyz, n, call.options, result)
        self._result = t = ffi.gc(result, lib.incode_tetrahedra_free)
        call.end()
        if status == lib.INCODE_NOT_FINITE:
            raise ValueError(
                f"row {t.at} of points is {points[t.at]}; remove rows that are "
                "not finite: points[numpy.isfinite(points).all(1)]"
            )
        _check(status)
        kind = _rows_kind(n)
        self.nsimplex = t.count
        self.simplices = _view(t, t.vertex, (t.count, 4), kind)
        # 2^64 - 1, which the library has on the hull, is -1.
        self.neighbors = _view(t, t.neighbor, (t.count, 4), np.int64)
        self.convex_hull = _view(t, t.hull, (t.hull_count, 3), kind)
        self._duplicates = _view(t, t.duplicate, (t.duplicate_count, 2), kind)

    def __reduce__(self):
        """Copies and pickles hold the points, and compute the rest again."""
        return partial(Delaunay, threads=self._threads), (self.points,)

    def find_simplex(self, xi, bruteforce=False, tol=None):
        """The lowest number of a simplex that contains each point, or -1.

        xi: array of shape (..., 3).  Facets, edges and vertices belong to their
        simplices.  A point that is not finite is in none.  The answer is
        exact, so `bruteforce` and `tol` change nothing.  The result is int64
        of shape (...).
        """
        if not (
            type(xi) is np.ndarray
            and xi.dtype == _FLOAT64
            and xi.flags.c_contiguous
            and xi.flags.aligned
            and xi.shape[-1:] == (3,)
        ):
            xi = _coordinates(xi, "xi")
        found = np.empty(xi.shape[:-1], np.int64)
        call, options = None, ffi.NULL
        if found.size >= _WATCHED:
            call = _Call(self._threads, None)
            options = call.options
        status = lib.incode_locate(
            self._xyz,
            self.npoints,
            self._result,
            ffi.from_buffer("double[]", xi),
            found.size,
            options,
            ffi.from_buffer("uint64_t[]", found),
            ffi.NULL,
        )
        if call is not None:
            call.end()
        if status == lib.INCODE_NOT_FINITE:
            return self._find_finite(xi)
        _check(status)
        return found

    def _find_finite(self, xi):
        finite = np.isfinite(xi).all(-1)
        found = np.full(finite.shape, -1, np.int64)
        found[finite] = self.find_simplex(xi[finite])
        return found

    @cached_property
    def vertex_neighbor_vertices(self):
        """(indptr, indices): the neighbours of vertex k are
        indices[indptr[k]:indptr[k + 1]], ascending."""
        call = _Call(self._threads, None, watched=self.nsimplex >= _WATCHED)
        result = ffi.new("struct incode_adjacency *")
        status = lib.incode_adjacency(
            self.npoints, self._result, call.options, result
        )
        a = ffi.gc(result, lib.incode_adjacency_free)
        call.end()
        _check(status)
        indptr = _view(a, a.first, (self.npoints + 1,), np.int64)
        return indptr, _view(
            a, a.to, (int(indptr[-1]),), _rows_kind(self.npoints)
        )

    @cached_property
    def vertex_to_simplex(self):
        """The lowest simplex at each vertex; -1 at duplicates."""
        first = np.full(self.npoints, self.nsimplex, np.int64)
        last_to_first = np.arange(self.nsimplex - 1, -1, -1)
        for column in range(4):
            # Of equal rows the last is kept, which is the lowest simplex.
            of_column = np.full(self.npoints, self.nsimplex, np.int64)
            of_column[self.simplices[::-1, column]] = last_to_first
            np.minimum(first, of_column, out=first)
        first[first == self.nsimplex] = -1
        return first

    @cached_property
    def transform(self):
        """Affine maps to barycentric coordinates, shape (nsimplex, 4, 3): the
        first three of x are transform[i, :3] @ (x - transform[i, 3]).  NaN
        where a simplex is flat in float64."""
        corners = self.points[self.simplices]
        last = corners[:, 3]
        a, b, c = (corners[:, i] - last for i in range(3))
        maps = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], 1)
        volume = (a * maps[:, 0]).sum(1)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            maps /= volume[:, None, None]
        maps[~np.isfinite(maps).all((1, 2))] = np.nan
        return np.concatenate([maps, last[:, None]], 1)

    @cached_property
    def coplanar(self):
        """Duplicates, shape (m, 3): the row that is no vertex, a simplex at its
        point, and the lower row with the same point, which is the vertex."""
        row, vertex = self._duplicates.T
        if len(row) == 0:
            return np.empty((0, 3), np.int64)
        return np.stack([row, self.vertex_to_simplex[vertex], vertex], 1)

    @cached_property
    def min_bound(self):
        return self.points.min(axis=0)

    @cached_property
    def max_bound(self):
        return self.points.max(axis=0)
