"""Files, read and written by the program `incode`, which knows the formats."""
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import warnings

import numpy as np

from ._delaunay import Delaunay, _coordinates, _rows_kind, _thread_count


def _program():
    """INCODE_PROGRAM; else that of this build or installation; else PATH's."""
    named = os.environ.get("INCODE_PROGRAM")
    if named:
        return named
    above = pathlib.Path(__file__).resolve().parent.parents
    beside = [
        above[i] / name
        for i, name in ((1, "incode"), (3, "bin/incode"))
        if i < len(above)
    ]
    for path in beside:
        if path.is_file() and os.access(path, os.X_OK):
            return str(path)
    found = shutil.which("incode")
    if found is None:
        raise FileNotFoundError(
            "the program incode is not found; install it, or set "
            "INCODE_PROGRAM to its path"
        )
    return found


# The program's exit status: of a wrong argument, and of a file's wrong content.
_STATUS = {2: ValueError, 3: ValueError}


def _run(*arguments):
    """Runs the program.  Raises its error, and warns of its other reports."""
    command = [_program(), *map(str, arguments)]
    try:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
        )
    except OSError as error:
        raise type(error)(
            error.errno,
            f"{error.strerror}; INCODE_PROGRAM names the program incode",
            command[0],
        ) from None
    with process:
        try:
            said = process.communicate()[1].strip()
        except BaseException:
            process.terminate()  # it removes what it has begun
            process.wait()
            raise
    status = process.returncode
    if status != 0:
        said = said or f"{command[0]} ended with status {status}"
        raise _STATUS.get(status, RuntimeError)(said)
    if said:
        warnings.warn(said, stacklevel=3)


def read(path, *, format=None):
    """What a file holds: points, float64 of shape (n, 3), or tetrahedra, rows
    of points, of shape (m, 4).

    A file that may hold both (.vtu, .vtk) is read as tetrahedra if it has some.
    format: a name as "vtu": the file is read as points in that format.
    """
    path = os.path.abspath(os.fspath(path))
    with open(path, "rb"):
        pass  # what is missing or not readable is Python's own exception
    with tempfile.TemporaryDirectory(prefix="incode-") as folder:
        out = os.path.join(folder, "out.npy")
        _run(
            "convert",
            *(() if format is None else (f"--format={format}",)),
            path,
            out,
        )
        array = np.load(out)
    if array.dtype.kind == "u":
        array = array.view(_rows_kind(int(array.max(initial=0)) + 1))
    return array


def write(path, points, simplices=None):
    """Writes a file in the format of its extension.

    points: an array (n, 3), or a Delaunay, which has tetrahedra, too.
    simplices: tetrahedra, an array (m, 4) of rows of `points`.
    """
    path = os.path.abspath(os.fspath(path))
    if isinstance(points, Delaunay):
        points, simplices = points.points, points.simplices
    points = _coordinates(points, "points")
    with tempfile.TemporaryDirectory(prefix="incode-") as folder:
        source = os.path.join(folder, "points.npy")
        np.save(source, points)
        if simplices is not None:
            # The program takes the points of rows from the file beside them.
            _run("convert", source, os.path.join(folder, "rows.node"))
            source = os.path.join(folder, "rows.npy")
            np.save(source, _rows(simplices, len(points)))
        _run("convert", source, path)


def _rows(simplices, points):
    array = np.asarray(simplices)
    if array.ndim != 2 or array.shape[1] != 4 or array.dtype.kind not in "iu":
        raise ValueError(
            f"simplices has the shape {array.shape} and type {array.dtype}; "
            "integers of shape (m, 4) are needed"
        )
    if array.size and not (0 <= array.min() and array.max() < points):
        raise ValueError(
            f"simplices has rows {array.min()} .. {array.max()}; there are "
            f"{points} points"
        )
    return array.astype(np.uint32, order="C")


def stream(points, out=None, *, host_memory="1G", scratch=None, threads=0):
    """The tetrahedra of more points than fit in memory, mapped from a file.

    points: the path of a file of points, or an array (n, 3), which is copied to
        a file.  It may be mapped from a file itself.
    out: a path that ends in .npy and keeps the result.  None: a file that goes
        with the array.
    host_memory: what the program may use, as "2G", or bytes; 16M or more.
    scratch: a folder on a disk for the rest.  Default: that of `out`, else that
        of the module tempfile.
    threads: how many work; 0: one a processor.

    The array has shape (m, 4) and is read-only, with rows as in
    Delaunay.simplices.
    """
    if out is not None:
        out = os.path.abspath(os.fspath(out))
        if not out.endswith(".npy"):
            raise ValueError(
                f"{out}: the result is mapped; give a name in .npy"
            )
    if scratch is None and out is not None:
        scratch = os.path.dirname(out)
    with tempfile.TemporaryDirectory(prefix="incode-", dir=scratch) as folder:
        result = out or os.path.join(folder, "out.npy")
        stats = os.path.join(folder, "stats.json")
        count = _thread_count(threads)
        _run(
            *("run", _points_file(points, folder), "-q", "-o", result),
            *("--stats", stats, "--scratch", folder),
            *("--host-memory", host_memory),
            *(("--threads", count) if count else ()),
        )
        with open(stats, encoding="utf-8") as file:
            rows = json.load(file)["points"]
        return np.load(result, mmap_mode="r").view(_rows_kind(rows))


def _points_file(points, folder):
    """The path of a file of points, which may be made in `folder`."""
    if isinstance(points, (str, os.PathLike)):
        path = os.path.abspath(os.fspath(points))
        with open(path, "rb"):
            return path
    array = np.asarray(points)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(
            f"points has the shape {array.shape}; (n, 3) is needed"
        )
    path = os.path.join(folder, "points.npy")
    with open(path, "wb") as file:
        np.lib.format.write_array_header_1_0(
            file,
            {"descr": "<f8", "fortran_order": False, "shape": array.shape},
        )
        for first in range(0, len(array), 1 << 16):
            block = _coordinates(array[first : first + (1 << 16)], "points")
            block.astype("<f8", copy=False).tofile(file)
    return path
