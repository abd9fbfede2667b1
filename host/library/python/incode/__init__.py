"""Exact 3D Delaunay triangulation with the interface of scipy.spatial.

>>> import numpy, incode
>>> cube = numpy.mgrid[0:2, 0:2, 0:2].reshape(3, -1).T
>>> tri = incode.Delaunay(cube)
>>> tri.nsimplex
6
>>> int(tri.find_simplex([0.5, 0.5, 2]))
-1
"""
from ._delaunay import Delaunay, __version__
from ._program import read, stream, write

__all__ = ["Delaunay", "read", "stream", "write"]
