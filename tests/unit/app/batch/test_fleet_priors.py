"""A manifest whose rows name a prior that is not for them is refused before any job runs."""

from pathlib import Path

import numpy as np
import pytest

from calib_core.errors import InputError
from calib_core.fleet_prior import FleetPrior
from calib_core.geometry import RigidTransform
from calib_core.interchange.own.fleet_prior_json import write_fleet_prior
from cocalib.batch.fleet_priors import require_priors_of_others
from cocalib.batch.manifest import Manifest, ManifestRow


def manifest(*rows: ManifestRow) -> Manifest:
    return Manifest(Path("fleet.toml"), rows)


@pytest.fixture
def prior(tmp_path: Path) -> Path:
    path = tmp_path / "van.json"
    pose = RigidTransform(np.eye(3), np.zeros(3))
    path.write_text(write_fleet_prior(FleetPrior("van", pose, 1e-4 * np.eye(6), tuple(f"V{k}" for k in range(9)))))
    return path


def row(vehicle: str, prior: Path | None, *, kind: str = "van") -> ManifestRow:
    return ManifestRow(vehicle, "s", (), vehicle_type=kind, fleet_prior=prior, place=f"session {vehicle}")


def test_new_vehicles_and_rows_without_a_prior_pass(prior: Path) -> None:
    require_priors_of_others(manifest(row("N1", prior), row("V1", None), row("N2", prior)))


def test_vehicles_that_it_rests_on_are_named_with_their_rows(prior: Path) -> None:
    rows = [row("N1", prior), *(row(f"V{k}", prior) for k in range(7))]
    with pytest.raises(InputError) as refused:
        require_priors_of_others(manifest(*rows))
    said = str(refused.value)
    assert said.startswith("fleet.toml: session V0 (V0 / s), session V1 (V1 / s), ")
    assert "and 2 more: fleet_prior: van.json: the prior rests on V0 itself" in said
    assert said.endswith("or name it only in the rows of new vehicles, best in a manifest of their own")


def test_another_type_is_refused_and_a_file_that_cannot_be_read_is_left_to_its_job(prior: Path) -> None:
    require_priors_of_others(manifest(row("N1", prior.with_name("none.json"))))
    with pytest.raises(InputError, match=r"session N1 .*vehicles of type van, and this vehicle is of type truck"):
        require_priors_of_others(manifest(row("N1", prior, kind="truck")))
