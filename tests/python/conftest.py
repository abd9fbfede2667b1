"""Writes a line for each test, as tests/run counts them, to INCODE_RESULTS."""
import os

import numpy
import pytest


@pytest.fixture
def rng():
    return numpy.random.default_rng(1)


def pytest_runtest_logreport(report):
    if report.when != "call" and report.passed:
        return
    if report.when == "teardown" and report.skipped:
        return
    name = "python/" + report.nodeid.split("::", 1)[1].replace("::", "/")
    why = report.longrepr[2] if report.skipped else str(report.longrepr or "")
    why = why.strip().splitlines()[-1] if why.strip() else ""
    line = {
        "passed": f"PASS {name}",
        "failed": f"FAIL {name}: {why}",
        "skipped": f"SKIP {name}: {why}",
    }[report.outcome]
    with open(os.environ["INCODE_RESULTS"], "a", encoding="utf-8") as results:
        results.write(line + "\n")
