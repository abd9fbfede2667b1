#!/usr/bin/python3
"""VTKHDF files as others write them, of the points in a file of text:
tests/system/vtkhdf.py POINTS FOLDER.  Those by the name of a kind hold the
points, the others have one fault each."""
import sys

import h5py
import numpy as np

points = np.loadtxt(sys.argv[1])
folder = sys.argv[2]
packed = {"chunks": True, "compression": "gzip", "shuffle": True}


def write(name, kind, parts, version=(2, 0), number="f8", **how):
    """parts: the points and the tetrahedra of each."""
    file = h5py.File(f"{folder}/{name}", "w")
    group = file.create_group("VTKHDF")
    group.attrs["Version"] = version
    text = h5py.string_dtype("ascii", len(kind))
    group.attrs.create("Type", kind.encode(), dtype=text)
    group["NumberOfPoints"] = [len(p) for p, _ in parts]
    group.create_dataset("Points", data=np.concatenate(
        [p for p, _ in parts]).astype(number), **how)
    if kind == "UnstructuredGrid":
        cells = [np.array(t, "i4").reshape(-1, 4) for _, t in parts]
        group["NumberOfCells"] = [len(t) for t in cells]
        group["NumberOfConnectivityIds"] = [4 * len(t) for t in cells]
        for name, data in {
                "Connectivity": [t.ravel() for t in cells],
                "Offsets": [4 * np.arange(len(t) + 1) for t in cells],
                "Types": [np.full(len(t), 10, "u1") for t in cells],
        }.items():
            data = np.concatenate(data)
            group.create_dataset(name, data=data,
                                 **(how if len(data) > 0 else {}))
    return group


def fault(name, kind="PolyData", **how):
    return write(f"{name}.vtkhdf", kind, [(points, [])], **how)


third = len(points) // 3
thirds = [(points[:third], []), (points[third:-1], []), (points[-1:], [])]
write("grid.vtkhdf", "UnstructuredGrid", [(points, [])], (1, 0))
write("parts.vtkhdf", "UnstructuredGrid", thirds, **packed)
write("poly.vtkhdf", "PolyData", thirds, number=">f8", chunks=(7, 2),
      compression=9, fletcher32=True)
group = write("variable.vtkhdf", "PolyData", thirds)
del group.attrs["Type"]
group.attrs["Type"] = "PolyData"
write("single.vtkhdf", "PolyData", [(points, [])], number="f4")
np.save(f"{folder}/single.npy", points.astype("f4"))

write("pair.hdf", "UnstructuredGrid",
      [(points[:9], [[0, 1, 2, 3], [4, 5, 6, 8]]), (points[9:20], [[7, 1, 2, 0]])],
      **packed)
with open(f"{folder}/pair.ele", "w", encoding="ascii") as file:
    file.write("3 4 0\n0 0 1 2 3\n1 4 5 6 8\n2 16 10 11 9\n")

fault("version", version=(3, 0))
fault("image", "ImageData")
fault("steps").create_group("Steps").attrs["NSteps"] = 2
del fault("none").file["VTKHDF"]
fault("sum")["NumberOfPoints"][0] = third
group = fault("many")
del group["NumberOfPoints"]
group["NumberOfPoints"] = [2 ** 32 - 1, len(points)]
fault("filter", compression="lzf")
group = fault("empty")
del group["Points"]
group.create_dataset("Points", (len(points), 3), "f8")
group = fault("linked")
del group["Points"]
group["Points"] = h5py.ExternalLink(f"{folder}/grid.vtkhdf", "/VTKHDF/Points")
group = fault("outside")
del group["Points"]
group["Others"] = points  # room for as many in the file
points.tofile(f"{folder}/outside.raw")
group.create_dataset("Points", (len(points), 3), "f8",
                     external=f"{folder}/outside.raw")
group = fault("flat")
del group["Points"]
group["Points"] = points.ravel()
