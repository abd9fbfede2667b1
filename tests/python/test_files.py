"""incode.read and incode.write, and the examples of the documents."""
import contextlib
import doctest
import io
import os
import pathlib
import re
import subprocess

import numpy as np
import pytest

import incode

PAGE = pathlib.Path("host/library/python/README.md")


@pytest.mark.parametrize(
    "name", ["p.xyz", "p.csv", "p.npy", "p.node", "p.ply", "p.vtu", "p.xyz.gz"]
)
def test_points(rng, tmp_path, name):
    points = rng.random((100, 3))
    if name.endswith(".gz"):
        np.savetxt(tmp_path / name, points, "%.17g")
    else:
        incode.write(tmp_path / name, points)
    assert (incode.read(tmp_path / name) == points).all()


@pytest.mark.parametrize(
    "name", ["t.vtu", "t.vtk", "t.ele", "t.msh", "t.mesh", "t.npy"]
)
def test_tetrahedra(rng, tmp_path, name):
    tri = incode.Delaunay(rng.random((100, 3)))
    incode.write(str(tmp_path / name), tri)
    rows = incode.read(str(tmp_path / name))
    assert rows.dtype == np.int32 and (rows == tri.simplices).all()
    other = tmp_path / f"other{name}"
    incode.write(
        other, tri.points.tolist(), tri.simplices.astype(np.int64)[::-1]
    )
    assert (incode.read(other) == tri.simplices).all()
    if name in ("t.vtu", "t.vtk"):
        assert (incode.read(other, format=name[2:]) == tri.points).all()


def test_errors(rng, tmp_path):
    points = rng.random((10, 3))
    with pytest.raises(FileNotFoundError):
        incode.read(tmp_path / "none.xyz")
    (tmp_path / "bad.xyz").write_text("1 2 3\n1 2\n")
    with pytest.raises(ValueError, match=r"incode: .*bad\.xyz:2:4: .*; "):
        incode.read(tmp_path / "bad.xyz")
    with pytest.raises(ValueError, match="incode: .*extension"):
        incode.write(tmp_path / "out.unknown", points)
    with pytest.raises(ValueError, match="incode: "):
        incode.read(tmp_path / "bad.xyz", format="unknown")
    with pytest.raises((ValueError, RuntimeError), match="incode: .*no/such"):
        incode.write(tmp_path / "no" / "such" / "p.xyz", points)
    for wrong, said in [
        ([[0, 1, 2]], r"shape \(1, 3\)"),
        ([[0, 1, 2, 10]], "0 .. 10"),
        ([[0, 1, 2, -1]], "-1 .. 2"),
        ([[0.0, 1, 2, 3]], "float64"),
    ]:
        with pytest.raises(ValueError, match=said):
            incode.write(tmp_path / "t.vtu", points, wrong)
    assert sorted(os.listdir(tmp_path)) == ["bad.xyz"]


def test_what_the_program_reports(tmp_path):
    (tmp_path / "p.xyz").write_text("1 2 3 4\n5 6 7 8\n")
    with pytest.warns(UserWarning, match="incode: .*column"):
        assert incode.read(tmp_path / "p.xyz").tolist() == [
            [1, 2, 3],
            [5, 6, 7],
        ]


def test_the_program(tmp_path, monkeypatch):
    (tmp_path / "p.xyz").write_text("1 2 3\n")
    monkeypatch.setenv("INCODE_PROGRAM", str(tmp_path / "none"))
    with pytest.raises(FileNotFoundError, match="INCODE_PROGRAM"):
        incode.read(tmp_path / "p.xyz")
    monkeypatch.setenv("INCODE_PROGRAM", "/bin/false")
    with pytest.raises(RuntimeError, match="/bin/false ended with status 1"):
        incode.read(tmp_path / "p.xyz")
    monkeypatch.delenv("INCODE_PROGRAM")
    assert incode.read(tmp_path / "p.xyz").shape == (1, 3)


@pytest.mark.parametrize("kind", ["file", "mapped", "float32", "list"])
def test_stream(rng, tmp_path, kind):
    scratch, path = tmp_path / "scratch", tmp_path / "p.npy"
    scratch.mkdir()
    points = rng.random((70000 if kind == "mapped" else 3000, 3)).astype("f4")
    np.save(path, points if kind == "float32" else points.astype("f8"))
    given = {
        "file": lambda: path,
        "mapped": lambda: np.load(path, mmap_mode="r"),
        "float32": lambda: np.load(path),
        "list": points.tolist,
    }[kind]()
    rows = incode.stream(given, host_memory="16M", scratch=scratch, threads=2)
    assert os.listdir(scratch) == []
    expected = incode.Delaunay(points).simplices
    assert rows.dtype == expected.dtype and not rows.flags.writeable
    assert (rows == expected).all()


def test_stream_keeps_its_file(rng, tmp_path):
    points = rng.random((1000, 3))
    rows = incode.stream(points, tmp_path / "t.npy", host_memory=1 << 25)
    assert os.listdir(tmp_path) == ["t.npy"]
    assert (np.load(tmp_path / "t.npy") == rows).all() and len(rows) > 6000


def test_errors_of_stream(rng, tmp_path):
    points = rng.random((10, 3))
    flat = points * [1, 1, 0]
    for given, options, said in [
        (points, {"out": tmp_path / "t.vtu"}, r"t\.vtu.*\.npy"),
        (points, {"host_memory": "1K"}, "incode: .*--host-memory 1K"),
        (points, {"threads": -1}, "threads=-1"),
        (points[:, :2], {}, r"shape \(10, 2\)"),
        (flat, {}, "incode: .*plane"),
    ]:
        with pytest.raises(ValueError, match=said):
            incode.stream(given, **{"scratch": tmp_path, **options})
    with pytest.raises(FileNotFoundError):
        incode.stream(tmp_path / "none.xyz", scratch=tmp_path)
    with pytest.raises(FileNotFoundError):
        incode.stream(points, scratch=tmp_path / "none")
    assert os.listdir(tmp_path) == []


def test_an_interrupt_ends_the_program(tmp_path, monkeypatch):
    program = tmp_path / "program"
    program.write_text(
        "#!/bin/sh\ntrap 'echo ended > $0.ended; exit' TERM\necho begun >&2\n"
        "while :; do read line < $0.none; done\n"
    )
    program.chmod(0o755)
    os.mkfifo(tmp_path / "program.none")
    (tmp_path / "p.xyz").write_text("1 2 3\n")

    def interrupted(process):
        assert process.stderr.readline() == "begun\n"
        raise KeyboardInterrupt

    monkeypatch.setenv("INCODE_PROGRAM", str(program))
    monkeypatch.setattr(subprocess.Popen, "communicate", interrupted)
    with pytest.raises(KeyboardInterrupt):
        incode.read(tmp_path / "p.xyz")
    assert (tmp_path / "program.ended").read_text() == "ended\n"


# --- documents ----------------------------------------------------------------


def test_docstrings():
    result = doctest.testmod(incode)
    assert result.attempted > 3 and result.failed == 0


def examples():
    return re.findall(
        r"^```python\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.M | re.S
    )


def run(code):
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        exec(compile(code, str(PAGE), "exec"), {})
    return said.getvalue()


def test_examples_of_the_page(tmp_path, monkeypatch):
    codes = examples()
    monkeypatch.chdir(tmp_path)
    assert len(codes) >= 3
    for code in codes:
        shown = "".join(re.findall(r"# prints (.*\n)", code))
        assert run(code) == shown


def test_one_line_changes(tmp_path, monkeypatch):
    code = examples()[0]
    monkeypatch.chdir(tmp_path)
    assert code.count("from incode import Delaunay") == 1
    theirs = code.replace("from incode import", "from scipy.spatial import")
    assert run(code) == run(theirs) != ""
