"""Files, read and written by the program `incode`, which knows the formats."""
import os
import pathlib
import shutil
import subprocess
import tempfile
import warnings

import numpy as np

from ._delaunay import Delaunay, _coordinates, _rows_kind


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
