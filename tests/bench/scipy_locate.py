"""Point location by scipy's find_simplex (Qhull).

    scipy_locate.py POINTS.npy QUERIES.npy

prints what tests/bench/locate.c prints, without its sum: Qhull's tetrahedra
are others where points are cospherical.
"""
import json
import sys
import time

import numpy
from scipy.spatial import Delaunay

points, queries = (numpy.load(name) for name in sys.argv[1:3])
triangulation = Delaunay(points)
cpu, wall = -time.process_time(), -time.monotonic()
found = triangulation.find_simplex(queries)
cpu, wall = cpu + time.process_time(), wall + time.monotonic()
print(json.dumps({"tetrahedra": int((found >= 0).sum()), "cpu_s": cpu,
                  "wall_s": wall}))
