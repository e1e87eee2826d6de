"""Types: of the tests and the package, and of the stubs against the compiled module."""

import os
import subprocess
import sys
from pathlib import Path

import pytest


def run(root: Path, *arguments: str) -> None:
    pytest.importorskip("mypy", reason="optional: pip install mypy")
    tests, package = root / "python" / "tests", root / "python"
    done = subprocess.run(
        [sys.executable, "-m", *arguments], cwd=root, capture_output=True, text=True,
        env=os.environ | {"MYPYPATH": f"{tests}{os.pathsep}{package}"},
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_mypy_is_content_with_tests_and_package(root: Path) -> None:
    run(root, "mypy", "--strict", "python/tests", "python/idmesh")


def test_the_stubs_are_those_of_the_module(root: Path) -> None:
    run(root, "mypy.stubtest", "idmesh", "--mypy-config-file", "pyproject.toml")
