"""The table of public sets: a further one is a row, and a converter where the product's readers cannot know its files."""

from functools import partial

from benchmarks.real import converters
from benchmarks.real.contents import RealSet
from calib_core.options import NoiseOptions

__all__ = ["SETS"]

_QUINTIN = ("QuintinUmi/lidar_camera_radar4d_cal", "447e11c169546f84263ee6e4151d8d8ff1cb5ff5", "none stated")
_ACFR = ("acfr/cam_lidar_calibration", "ecda574ed902913fbc2ae50f92ad3356f318431c", "Apache-2.0")
_HEETHESH = ("heethesh/lidar_camera_calibration", "688397c500967a42b2aca82d6c11393dd73aaa9c", "BSD-3-Clause")
_GOLDWURM = (
    "AlessandroGoldwurm/MultiFishEye_Lidar_Radar-Calib",
    "1a6c0429446b8291b3dbac2b7dbec6fd47efc549",
    "none stated",
)
_NITISH = ("Nitishkr22/Radar_Calibration", "cd822646f69f229ce84d7c2377bfd48b85d27246", "none stated")
_PJLAB = ("PJLab-ADG/SensorsCalibration", "7fe8d46caac040cbcd89cc65e79e5519df01bcd4", "Apache-2.0")
_DELFT = ("tudelft-iv/view-of-delft-dataset", "a9df89290f118965b73e5cb4aa5409f42862894b", "Apache-2.0")

_ACFR_FILES = ("data/vlp/poses.csv", "data/vlp/calibration_quickstart.csv", "data/vlp/images/pose*.png")
_HEETHESH_FILES = ("calibration_data/lidar_camera_calibration/*", "calibration_data/camera_calibration/ost.yaml")
_SCENE_FILES = tuple(
    pattern for scene in converters.SCENES for pattern in (f"data/RADAR/{scene}-*.csv", f"data/camera/{scene}/*.jpg")
)
_ROAD_FILES = ("0.jpg", "front_radar.csv", "center_camera-intrinsic.json", "radar-to-center_camera-extrinsic.json")
_OF_A_LIDAR = NoiseOptions(1.0, 0.015, 0.3, 0.3)
_OF_HASTY_CLICKS = NoiseOptions(6.0, 0.03, 1.15, 1.15, estimate_scale=False)
_LONG = "published: a 3D fit of these boards, which takes the radar's ranges, 12 cm long, for its position"
_FIT = "published: a 3D fit of these boards; the lidar's x axis is not this camera's direction"
_BOARDS = "published: mean of 50 fits; the lens is found here in the 40 images; one board is 53 px off"
_MISCLICKS = "misclicks; published: OpenCV's RANSAC fit of nine of the 16, to 0.001 deg, so itself uncertain by 4 deg"


def _at_boards(
    name: str, what: str, sha256: str, bias: str, names: tuple[str, str, str], noise: NoiseOptions | None = None
) -> RealSet:
    """Return a row of board positions by radar or lidar and by the camera: the files of points, extrinsics and lens."""
    points, extrinsics, lens = names
    files = (f"data/{points}", f"result/{extrinsics}", f"config/{lens}")
    return RealSet(
        name, what, *_QUINTIN, files, sha256, partial(converters.camera_points, *names), bias, noise or NoiseOptions()
    )


def _lidar(camera: int, lidar: str, sha256: str) -> RealSet:
    rig = f"cam{camera}_{lidar}"
    folder = "lidar_camera"
    names = f"{folder}/point_set_{rig}.csv", f"{folder}/extrinsics_{rig}.yaml", f"camera-intrinsics_cam{camera}.yaml"
    what = "lidar, boards; noise of a lidar"
    return _at_boards(rig.replace("_", "-"), what, sha256, _FIT, names, noise=_OF_A_LIDAR)


SETS = {
    row.name: row
    for row in (
        _at_boards(
            "radar4d-17",
            "4D radar, 17 boards",
            "2f4f8e61144af1d7101d2411f00339841cf99d686560d563c24adde0ed64524a",
            _LONG,
            (
                "radar_camera/point_set.csv",
                "radar_camera/extrinsics_radar_camera2.yaml",
                "camera-intrinsics.yaml",
            ),
        ),
        _at_boards(
            "radar4d-85",
            "4D radar, 85 boards",
            "945de7cce3fe2f655900b0e97b9d5fdb579fd7f9379f8baec35966faf85a1fda",
            f"{_LONG}; five boards are 16 to 21 cm from it",
            (
                "radar_camera/point_set_radar_camera.csv",
                "radar_camera/extrinsics_radar_camera1.yaml",
                "camera-intrinsics.yaml",
            ),
        ),
        RealSet(
            "fisheye-47",
            "radar, fisheye camera, 47 reflectors",
            *_GOLDWURM,
            ("data/Radar_FE_point_pairs/*.txt",),
            "dac5aaf06c9dcaf10abe2c7bfaf7e94432059028202c40d3cca663f7bb4175d7",
            converters.fisheye_pairs,
            "no extrinsics published",
        ),
        RealSet(
            "two-reflectors",
            "2D radar, 10 reflectors in 5 scenes",
            *_NITISH,
            _SCENE_FILES,
            "dbb7b7d35ccb24c235c72b3f754fc0a8727e8fbc6130ef74aecf9af1d3cbee55",
            converters.two_reflectors,
            "neither extrinsics nor lens published; the focal length is fixed at 706 px, where the camera comes out 2.2 m behind "
            "the radar, at 550 px beside it; the clicks are ours",
        ),
        RealSet(
            "boards-40",
            "lidar, 40 chessboards",
            *_ACFR,
            _ACFR_FILES,
            "05d9e43fdf0455feb72429e5b84c5edc73b6ceec7962993a9619aade27ccbb44",
            converters.chessboards,
            _BOARDS,
        ),
        RealSet(
            "boards-40-lidar",
            "the same; noise of a lidar",
            *_ACFR,
            _ACFR_FILES,
            "05d9e43fdf0455feb72429e5b84c5edc73b6ceec7962993a9619aade27ccbb44",
            converters.chessboards,
            _BOARDS,
            _OF_A_LIDAR,
        ),
        RealSet(
            "clicks-16",
            "lidar, 16 clicks",
            *_HEETHESH,
            _HEETHESH_FILES,
            "383625d5fbbc764765e37b44167f6f0d10e95994073b54537aa75663aa115949",
            converters.npy_clicks,
            _MISCLICKS,
        ),
        RealSet(
            "clicks-16-hasty",
            "the same; noise of hasty clicks",
            *_HEETHESH,
            _HEETHESH_FILES,
            "383625d5fbbc764765e37b44167f6f0d10e95994073b54537aa75663aa115949",
            converters.npy_clicks,
            _MISCLICKS,
            _OF_HASTY_CLICKS,
        ),
        RealSet(
            "road",
            "2D radar, a road without a reflector",
            *_PJLAB,
            tuple(f"radar2camera/manual_calib/data/{name}" for name in _ROAD_FILES),
            "cac656f6ec767bb7f8a0f941c8d96310d6b183b8387b370a621cbcbf600a3f8c",
            converters.road,
            "published: set by hand; half a second and one image, so that the right answer is none",
        ),
        RealSet(
            "view-of-delft",
            "4D radar, 3 frames of traffic with cuboids",
            *_DELFT,
            ("example_set/radar/training/[civ]*/*", "example_set/lidar/training/label_2/*.txt"),
            "fabbafd28549ef8d0f71ab28b8010f11560d925d6a01ea94f146690a983cb759",
            converters.view_of_delft,
            "the cuboids are drawn in the lidar's points; Acc is not accuracy",
        ),
        _lidar(0, "hesai1", "c0c478a64f95fda6000d1aaa1853d8edcb1ab5531e134ae3513be6a367a6a9b5"),
        _lidar(0, "velodyne", "8ae15d4a39f58445bad57d564ad76e3f41dd669586e87667acb5c6864da373b5"),
        _lidar(1, "hesai1", "a91346bc2959af75d713cad2929954050b9d4f45616c2b74f20ed03db41177ea"),
        _lidar(1, "velodyne", "e57a9383739fbfdc8ebb693c83a7d8d80d4704298bbe10546e560ae60d59b349"),
        _lidar(2, "hesai1", "2d66b6f7956b8b4daa9a0cee29d89eb591497949d2a2cc51a14589701bc31746"),
        _lidar(2, "velodyne", "dfbb01571f6d4ba1a8be399524d523e1aca7d340481cadf05f166e9f1a513af2"),
        _lidar(3, "hesai1", "39f6e1e99161327ace1dc22d72932981c6478a1181b53bde6d568cbb519df669"),
        _lidar(3, "velodyne", "b239a637d2f6401a1963eb72624810aa80629c3c16bc57e5c83b58fabbcf75f4"),
        _lidar(4, "hesai1", "44e8740a6c6903c17b8b6b2a507ffc160ad15fb6266e637ec08ba673e1515d6f"),
        _lidar(4, "velodyne", "a3c4c01db0430b56d63ac67eecb7d0085e159090d6f5b5a27d49b426f4408561"),
        _lidar(5, "hesai1", "440db73fabbcb02898ab1e1013ca047110c162133b1fed725fb307cc5457e655"),
        _lidar(5, "velodyne", "d54ef989dc45acf596d6d2c8902aec027c98378f81bd1c805188a25b1189e6f7"),
        _lidar(6, "velodyne", "9ce3cd87ea5691c5245fa2582aac932e1bdb91c928b7e1205a831d466634c135"),
    )
}
"""By name; the digests are printed where files differ."""
