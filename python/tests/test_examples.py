"""The examples of examples/python, run as a user runs them."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from box import Box

import idmesh

# The package in whose place the test is skipped, and what installs it.
OPTIONAL = {
    "with_joblib.py": "joblib",
    "with_dask.py": "distributed",
    "with_ray.py": "ray",
    "with_submitit.py": "submitit",
}


def run(arguments: list[str], folder: Path, **environment: str) -> str:
    names = {"RAYON_NUM_THREADS": "1", "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(
        arguments, cwd=folder, capture_output=True, text=True, timeout=600, env=os.environ | names | environment
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def folder(root: Path) -> Path:
    return root / "examples" / "python"


@pytest.fixture(scope="module")
def expected(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    """The lines of `designs.py`, one design after another."""
    made = tmp_path_factory.mktemp("designs")
    lines = run([sys.executable, str(folder / "designs.py"), str(made)], made)
    assert len(lines.splitlines()) == 6 and len(list(made.iterdir())) == 6
    return lines


@pytest.mark.parametrize("name", OPTIONAL)
def test_engines_find_what_one_process_finds(name: str, folder: Path, expected: str, tmp_path: Path) -> None:
    package = OPTIONAL[name]
    if importlib.util.find_spec(package) is None:
        pytest.skip(f"optional: pip install {package}")
    assert run([sys.executable, str(folder / name)], tmp_path) == expected


def test_snakemake_finds_what_one_process_finds(folder: Path, expected: str, tmp_path: Path) -> None:
    if importlib.util.find_spec("snakemake") is None:
        pytest.skip("optional: pip install snakemake")
    run([sys.executable, "-m", "snakemake", "-s", str(folder / "Snakefile"), "--cores", "2", "--directory",
         str(tmp_path)], tmp_path)
    found = {float(path.read_text().split()[0]): path.read_text().split()[1] for path in tmp_path.glob("beta-*.txt")}
    assert found == {float(line.split()[0]): repr(float(line.split()[1])) for line in expected.splitlines()}


@pytest.mark.skipif(os.name == "nt", reason="the script is for bash")
def test_tasks_of_a_slurm_array_share_the_designs(folder: Path, expected: str, tmp_path: Path) -> None:
    lines = []
    for task in range(3):
        variables = {"SLURM_ARRAY_TASK_ID": str(task + 1), "SLURM_ARRAY_TASK_MIN": "1", "SLURM_ARRAY_TASK_COUNT": "3"}
        lines += run([str(folder / "slurm_array.sh"), str(tmp_path)], folder, **variables).splitlines()
    assert sorted(lines) == sorted(expected.splitlines())
    assert len(list(tmp_path.iterdir())) == 6


def test_the_loop_around_su2_goes_down(folder: Path, box: Box, box_path: Path, tmp_path: Path) -> None:
    lines = run([sys.executable, str(folder / "su2_loop.py"), str(box_path), str(tmp_path)], folder)
    values = [float(line) for line in lines.splitlines()]
    assert len(values) == 5 and all(np.diff(values) < 0), values
    last = idmesh.Mesh.read(tmp_path / "DESIGNS" / "DSN_005" / "mesh_deformed.su2")
    assert np.array_equal(last.tets, idmesh.Mesh.read(box_path).tets)
    assert np.isclose(0.5 * np.sum((last.vertices - 0.4) ** 2), values[-1], rtol=1e-12)


def test_the_loop_on_an_openfoam_case_writes_points_alone(
    folder: Path, mover: idmesh.Mover, tmp_path: Path
) -> None:
    case = tmp_path / "case"
    (case / "constant" / "polyMesh").mkdir(parents=True)
    mover.update().write(case / "constant" / "polyMesh")
    lines = run([sys.executable, str(folder / "dafoam_loop.py"), str(case), "body", str(tmp_path)], folder)
    designs = [Path(line) for line in lines.splitlines()]
    assert len(designs) == 2
    for design in designs:
        assert not np.array_equal(idmesh.Mesh.read(design).vertices, idmesh.Mesh.read(case).vertices)
        files = sorted(path.name for path in (case / "constant" / "polyMesh").iterdir())
        assert sorted(path.name for path in (design / "constant" / "polyMesh").iterdir()) == files
        for name in files:
            one, other = (where / "constant" / "polyMesh" / name for where in (case, design))
            assert (one.read_bytes() == other.read_bytes()) == (name != "points"), name


def test_an_optimiser_finds_hidden_sections(folder: Path, tmp_path: Path) -> None:
    """J falls to a millionth, or the example ends with an error."""
    if importlib.util.find_spec("scipy") is None:
        pytest.skip("optional: pip install scipy")
    lines = run([sys.executable, str(folder / "optimise.py")], tmp_path).splitlines()
    errors = [float(line.split()[4]) for line in lines if line.startswith("  step")]
    assert len(errors) == 4 and min(errors) < 1e-7, lines
    assert float(lines[-2].split()[1]) < 1e-6, lines
