"""Every format of boxes in one table, in the order in which they are tried. To add one: write its module, and add a line."""

from calib_core.boxes.formats.box_format import BoxFormat
from calib_core.boxes.formats.coco import COCO
from calib_core.boxes.formats.cvat import CVAT
from calib_core.boxes.formats.kitti import KITTI_OBJECTS, KITTI_TRACKS
from calib_core.boxes.formats.openlabel import OPENLABEL
from calib_core.boxes.formats.own import OWN
from calib_core.boxes.formats.yolo import YOLO

BOX_FORMATS: tuple[BoxFormat, ...] = (OWN, OPENLABEL, COCO, CVAT, KITTI_TRACKS, KITTI_OBJECTS, YOLO)
