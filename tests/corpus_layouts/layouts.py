"""Ways in which rigs, vendors and data sets record, each written into a folder with its truth."""

from collections.abc import Callable
from pathlib import Path

from tests.corpus_layouts import clouds, data_sets, files, messages
from tests.corpus_layouts.truth import Truth

LAYOUTS: dict[str, Callable[[Path], Truth]] = messages.TARGET_LISTS | {
    layout.__name__: layout
    for layout in (
        messages.nested_twice,
        messages.arrays_side_by_side,
        clouds.odd_big_endian_cloud,
        clouds.cloud_of_integers,
        clouds.points_beside_a_lidar,
        clouds.near_and_far,
        clouds.front_and_side,
        files.json_lines,
        files.german_table,
        files.tab_separated,
        files.lists_and_dates,
        files.scans_paired_by_number,
        files.data_port,
        data_sets.view_of_delft,
        data_sets.kitti_raw_drive,
        data_sets.nuscenes_mini,
        data_sets.tj4dradset,
        data_sets.radiate,
        data_sets.astyx,
        data_sets.k_radar,
    )
}
