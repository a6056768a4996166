"""Heavy libraries are imported only when needed, not with the package: `cocalib --help` must not wait for OpenCV."""

import subprocess
import sys

import pytest

HEAVY = ("viser", "cv2", "rosbags", "rerun", "scipy", "websockets", "tyro", "jaxtyping", "asyncio", "unittest")


def heavy_modules_after(statement: str) -> str:
    """Run a statement in a fresh interpreter and return the heavy packages that it imports."""
    program = f"{statement}\nimport sys\nprint(*sorted(set({HEAVY!r}) & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_the_core_imports_nothing_heavy():
    assert heavy_modules_after("import calib_core") == ""


def test_the_mathematics_imports_nothing_heavy(project_root):
    core = project_root / "calib_core"
    rooms = ("lens_models", "association", "estimation", "diagnostics", "paper", "advice")
    files = [*core.glob("[!_]*.py"), *(file for room in rooms for file in (core / room).rglob("[!_]*.py"))]
    modules = sorted(".".join(file.relative_to(project_root).with_suffix("").parts) for file in files)
    assert {"calib_core.camera", "calib_core.paper.pnp", "calib_core.estimation.errors_in_variables"} <= set(modules)
    assert heavy_modules_after("".join(f"import {module}\n" for module in modules)) == ""


def test_numpy_random_is_not_imported_before_it_is_needed():
    """NumPy imports `numpy.random`, and OpenSSL with it, on first access; a quoted annotation does not access it."""
    code = "import calib_core.calibration, sys\nprint('numpy.random' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_a_verdict_needs_no_optimizer_of_scipy():
    """`scipy.optimize` is a third of a second of every `cocalib solve`, and of the first answer on the page."""
    code = (
        "import sys\nfrom dataclasses import replace\nimport numpy as np\n"
        "from calib_core.calibration import calibrate_pairs\nfrom calib_core.results.verdict import stated_error\n"
        "from benchmarks.simulated_pairs import simulate_pairs\n"
        "drawn = simulate_pairs(8, rng=np.random.default_rng(1))\n"
        "answer = calibrate_pairs(drawn.pairs, drawn.camera).unwrap()\n"
        "stated_error(replace(answer, covariance_quantile=20.0))\nprint('scipy.optimize' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_session_and_view_import_nothing_heavy():
    assert heavy_modules_after("import cocalib.session.applying\nimport cocalib.view.build") == ""


@pytest.mark.parametrize(
    "package",
    [
        "calib_core.interchange.importing",
        "calib_core.interchange.exporting",
        "calib_core.synthetic.recording",
        "calib_core.recordings",
    ],
)
def test_the_borders_of_the_core_import_nothing_heavy(package):
    assert heavy_modules_after(f"import {package}") == ""


def test_a_page_opens_before_scipy_is_needed():
    """Importing `scipy.stats` for the lens took a second of every start."""
    assert "scipy" not in heavy_modules_after("import cocalib.opening").split()


def test_a_heavy_import_would_be_seen():
    assert heavy_modules_after("import cv2") == "cv2"
