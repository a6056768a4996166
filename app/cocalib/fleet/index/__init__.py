"""The index of a fleet: one SQLite file next to the results, which it can be written again from at any time."""

from cocalib.fleet.index.reading import read_fleet
from cocalib.fleet.index.result_reading import finished_results
from cocalib.fleet.index.tables import INDEX_FILE, INDEX_VERSION, index_path
from cocalib.fleet.index.writing import FleetIndex, rebuild_index

__all__ = ["INDEX_FILE", "INDEX_VERSION", "FleetIndex", "finished_results", "index_path", "read_fleet", "rebuild_index"]
