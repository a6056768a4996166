"""The file of a fleet's prior, as a user gave it: for the solver its content, for the provenance its digest."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

from calib_core.errors import InputError
from calib_core.fleet_prior import FleetPrior
from calib_core.input_files import name_text
from calib_core.interchange.own.fleet_prior_json import read_fleet_prior
from calib_core.results import InputFile
from cocalib.platform.files import read_text


@dataclass(frozen=True, slots=True, eq=False)
class FleetPriorFile:
    """A fleet's prior with the file that it was read from.

    Attributes:
        prior: what the file says.
        file: identified by its content.
    """

    prior: FleetPrior
    file: InputFile

    @classmethod
    def read(cls, path: Path) -> "FleetPriorFile":
        """Read a file (cocalib/fleet-prior-1).

        Raises:
            InputError: it cannot be read, or contains no prior.
        """
        text = read_text(path)
        data = text.encode()
        digest = hashlib.sha256(data).hexdigest()
        return cls(read_fleet_prior(text, str(path)), InputFile(name_text(path.name), len(data), digest))

    def require_of_type(self, vehicle_type: str | None) -> None:
        """Refuse a prior of another type of vehicle.

        Args:
            vehicle_type: of the vehicle; None if nobody said.

        Raises:
            InputError: it is of another.
        """
        if vehicle_type is not None and vehicle_type != self.prior.vehicle_type:
            raise InputError(
                f"{self.file.name}: the prior is of vehicles of type {self.prior.vehicle_type}, and this vehicle is of type "
                f"{vehicle_type}; give the prior of its own type, or none"
            )

    def require_not_of(self, vehicle: str | None) -> None:
        """Refuse a prior that rests on the vehicle itself: what is known of it would count twice.

        Args:
            vehicle: its name; None if nobody said.

        Raises:
            InputError: it does.
        """
        same = {name for name in self.prior.vehicles if vehicle and name.casefold() == vehicle.strip().casefold()}
        if same:
            name = vehicle if vehicle in same else f"{vehicle} ({sorted(same)[0]})"
            raise InputError(
                f"{self.file.name}: the prior rests on {name} itself, so that its earlier calibrations would count twice; "
                f"write one without it (cocalib fleet prior {self.prior.vehicle_type} OUT --without {sorted(same)[0]} --out FILE)"
            )
