"""What is refused, what is raised, interrupts, and threads of Python."""
import gc
import subprocess
import sys
import textwrap
import threading
import weakref

import numpy as np
import pytest

import incode
from incode import _delaunay


REFUSED = {
    "a number": (1.0, r"shape \(\)"),
    "None": (None, r"shape \(\)"),
    "an empty list": ([], r"shape \(0,\)"),
    "one point": ([1, 2, 3], r"shape \(3,\)"),
    "a plane's": (np.zeros((5, 2)), r"shape \(5, 2\)"),
    "three axes": (np.zeros((2, 5, 3)), r"shape \(2, 5, 3\)"),
    "complex": (np.zeros((4, 3), complex), r"shape \(4, 3\).*complex"),
    "text": ([["a", "b", "c"]], r"shape \(1, 3\).*float64"),
    "objects": ([[None] * 3] * 4, "row 0 of points is .nan"),
    "sets": ([[{1}] * 3] * 4, r"shape \(4, 3\).*float64"),
    "masked": (
        np.ma.masked_array(np.ones((5, 3)), True),
        r"shape \(5, 3\).*masked",
    ),
    "ragged": ([[1, 2, 3], [1]], "shape"),
    "no rows": (np.zeros((0, 3)), "fewer than four"),
    "three": (np.eye(3), "fewer than four"),
    "nine alike": ([[1, 2, 3]] * 9, "fewer than four"),
    "a line": (np.arange(15.0).reshape(5, 3), "plane or line"),
    "a plane": (
        [[x, y, x + y] for x in range(3) for y in range(3)],
        "plane or line",
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_refused(what):
    points, said = REFUSED[what]
    with pytest.raises(ValueError, match=said):
        incode.Delaunay(points)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_not_finite(rng, bad):
    points = rng.random((3000, 3))
    points[1234, 1] = bad
    with pytest.raises(ValueError, match="row 1234 of points .*remove"):
        incode.Delaunay(points)


@pytest.mark.parametrize(
    "threads, kind",
    [
        (-1, ValueError),
        (1 << 32, ValueError),
        (1.5, TypeError),
        ("2", TypeError),
    ],
)
def test_threads_refused(rng, threads, kind):
    with pytest.raises(kind):
        incode.Delaunay(rng.random((10, 3)), threads=threads)


def test_scipys_other_options_are_refused(rng):
    for name in ("furthest_site", "incremental", "qhull_options"):
        with pytest.raises(TypeError, match=name):
            incode.Delaunay(rng.random((10, 3)), **{name: True})


def test_each_status_has_its_exception():
    from incode._delaunay import _ERRORS, lib

    known = {
        getattr(lib, name)
        for name in dir(lib)
        if name
        in (
            "INCODE_NO_MEMORY",
            "INCODE_BAD_ARGUMENT",
            "INCODE_TOO_FEW",
            "INCODE_FLAT",
            "INCODE_TOO_MANY",
            "INCODE_IO",
            "INCODE_INTERNAL",
        )
    }
    assert len(known) == 7 and set(_ERRORS) == known


def in_child(script):
    """Runs the script in a process of its own."""
    return subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script)],
        text=True,
        capture_output=True,
        check=False,
    )


def test_no_memory():
    done = in_child(
        """
        import resource, numpy, incode
        points = numpy.random.default_rng(1).random((300000, 3))
        pages = int(open("/proc/self/statm").read().split()[0])
        used = pages * resource.getpagesize()
        limit = resource.getrlimit(resource.RLIMIT_AS)[1]
        resource.setrlimit(resource.RLIMIT_AS, (used + (50 << 20), limit))
        try:
            incode.Delaunay(points, threads=1)
        except MemoryError as error:
            print(error)
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
        print(incode.Delaunay(points[:100]).nsimplex > 300)
    """
    )
    said = done.stdout.splitlines()
    assert (
        len(said) == 2 and "memory" in said[0] and said[1] == "True"
    ), done.stderr


# --- progress and interrupts --------------------------------------------------


def test_progress(rng):
    seen, threads = [], set()

    def progress(done):
        seen.append(done)
        threads.add(threading.get_ident())

    points = rng.random((100000, 3))
    tri = incode.Delaunay(points, progress=progress)
    assert (
        seen == sorted(seen)
        and seen[-1] == 1.0
        and threads == {threading.get_ident()}
    )
    assert (tri.simplices == incode.Delaunay(points).simplices).all()


@pytest.mark.parametrize("count", [10, 100000])
def test_exception_of_progress(rng, count):
    class Enough(Exception):
        pass

    def progress(done):
        raise Enough(done)

    with pytest.raises(Enough):
        incode.Delaunay(rng.random((count, 3)), progress=progress)


def test_exception_of_progress_comes_before_other_errors(rng):
    points = rng.random((3000, 3))
    points[2999] = np.nan

    def progress(done):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        incode.Delaunay(points, progress=progress)


def test_interrupt_among_queries_that_are_not_finite(rng, monkeypatch):
    """A call that ends with another status, and is followed by another."""
    tri = incode.Delaunay(rng.random((100, 3)))
    queries = rng.random((2000, 3))
    queries[0] = np.nan

    class Interrupted(_delaunay._Call):
        times = 0

        @property
        def progress(self):
            Interrupted.times += 1
            if Interrupted.times == 1:
                raise KeyboardInterrupt

        @progress.setter
        def progress(self, function):
            pass

    monkeypatch.setattr(_delaunay, "_Call", Interrupted)
    with pytest.raises(KeyboardInterrupt):
        tri.find_simplex(queries)


@pytest.mark.parametrize("fails", [False, True])
def test_calls_are_freed_without_the_collector(rng, fails):
    points, kept = rng.random((2000, 3)), []
    freed = weakref.ref(points)

    def progress(done):
        if not kept:
            kept.append(weakref.ref(progress))
        if fails:
            raise ArithmeticError

    gc.disable()
    try:
        try:
            tri = incode.Delaunay(points, progress=progress)
            tri.find_simplex(points)
        except ArithmeticError:
            tri = None
        calls = [x for x in gc.get_objects() if type(x) is _delaunay._Call]
        del tri, points, progress
        assert not calls and freed() is None and kept[0]() is None
    finally:
        gc.enable()


INTERRUPT = """
    import os, signal, numpy, incode
    points = numpy.random.default_rng(1).random((400000, 3))
    tri = incode.Delaunay(points[:5000])
    queries = numpy.random.default_rng(2).random((3000000, 3))
    def press(*_):
        os.kill(os.getpid(), signal.SIGINT)
    def progress(done):
        press()
    def interrupt(number, frame):
        at = frame
        while at is not None and at.f_code.co_name != "incode_tick":
            at = at.f_back
        print("within" if at is not None else "after")
        signal.default_int_handler(number, frame)
    signal.signal(signal.SIGINT, interrupt)
    # The signal of a timer that runs while this process works.
    signal.signal(signal.SIGPROF, press)
    signal.setitimer(signal.ITIMER_PROF, {seconds})
    result = None
    try:
        result = {call}
    except KeyboardInterrupt:
        print("interrupted", result)
    print(incode.Delaunay(points[:100]).nsimplex > 300)
"""


@pytest.mark.parametrize(
    "call, seconds",
    [
        ("incode.Delaunay(points, threads=1, progress=progress)", 0),
        ("incode.Delaunay(points, threads=1)", 0.05),
        ("incode.Delaunay(points)", 0.05),
        ("tri.find_simplex(queries)", 0.05),
    ],
    ids=["in progress", "one thread", "all threads", "find_simplex"],
)
def test_interrupt(call, seconds):
    done = in_child(INTERRUPT.format(call=call, seconds=seconds))
    # The signal is handled within the call, not when it has ended.
    assert done.stdout.split() == ["within", "interrupted", "None", "True"], (
        done.stdout + done.stderr
    )
    assert done.stderr == "" and done.returncode == 0


# --- threads ------------------------------------------------------------------


def test_others_run_meanwhile(rng):
    """Python takes the interpreter from no thread here.  So this thread goes on
    before the call ends only if the call has released the interpreter."""
    points = rng.random((200000, 3))
    before = sys.getswitchinterval()
    sys.setswitchinterval(1000)
    try:
        for _ in range(10):  # a busy machine may wake this thread late
            order, begun = [], threading.Event()

            def work():
                begun.set()
                incode.Delaunay(points, threads=1)
                order.append("call")

            thread = threading.Thread(target=work)
            thread.start()
            begun.wait()
            order.append("other")
            thread.join()
            if order[0] == "other":
                break
    finally:
        sys.setswitchinterval(before)
    assert order == ["other", "call"]


def test_calls_at_once(rng):
    sets = [rng.random((n, 3)) for n in (20000, 30000, 2000, 40000)]
    results = [None] * len(sets)

    def work(i):
        tri = incode.Delaunay(sets[i], threads=2)
        results[i] = tri, tri.find_simplex(sets[i])

    threads = [
        threading.Thread(target=work, args=(i,)) for i in range(len(sets))
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for points, (tri, found) in zip(sets, results):
        alone = incode.Delaunay(points, threads=1)
        assert (tri.simplices == alone.simplices).all()
        assert (found == alone.find_simplex(points)).all()
