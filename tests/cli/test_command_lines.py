"""Command lines with their exit codes and the words that they end with; help says the law of exit codes."""

import json
import shlex
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

from calib_core.geometry import OPTICAL_FROM_LINK, RigidTransform
from calib_core.proposing import chance
from calib_core.recordings.containers.writing import write_ros2
from cocalib.cli import run
from cocalib.cli.commands import COMMANDS
from cocalib.cli.exit_codes import batch_exit_code, exit_codes
from tests.cli.conftest import Made, pairs_text

_MADE = Made(placements=20)
_POSITION_M = tuple(f"{value:.6f}" for value in _MADE.camera_from_radar.inverse().translation_m)
_TABLE = [
    (0, "solve --pairs good-pairs.json --out o.json --require usable", "verdict: usable"),
    (1, "solve --pairs few.json --out o.json", "2 of"),
    (0, "solve made.mcap --clicks off.json --out o.json", "\ndisagrees: c5: "),
    (1, "solve made.mcap --clicks three.json --out o.json", "3 of"),
    (2, "solve", "--clicks"),
    (2, "solve a.bag", "--clicks"),
    (2, "solve --pairs", "--pairs needs a value: --pairs FILE; see cocalib solve --help"),
    (2, "solve --pairs absent.json", "absent.json: no such file"),
    (2, "solve --pairs a.json --clicks b.json", "not both"),
    (
        2,
        "solve --pairs misspelt.json --out o.json",
        "misspelt.json: pairs[0].pixl_px: unknown key; did you mean pixel_px?",
    ),
    (2, "solve --pairs good-pairs.json --method pmm", "--method takes default or paper, not 'pmm'"),
    (2, "solve --pairs good-pairs.json --camera good-pairs.json", "brings its own camera"),
    (2, "solve --pairs good-pairs.json --radar-axes up,up,up", "leave out --map"),
    (2, "solve --pairs good.json --set gating.max_range_m=8", "gating.max_range_m chooses radar returns"),
    (2, "solve --pairs good-pairs.json --out .", "is a folder"),
    (2, "solve --pairs good-pairs.json --out nowhere/a.json", "does not exist; create it"),
    (2, "solve --pairs pairs.csv", "add --camera FILE"),
    (2, "solve absent.bag --clicks clicks.json --out o.json", "absent.bag: no such file"),
    (2, "solve no-radar.mcap --clicks clicks.json --out o.json", "no readable radar topic"),
    (2, "solve no-camera.mcap --clicks clicks.json --out o.json", "no intrinsics"),
    (
        2,
        "solve made.mcap --clicks stray.json --out o.json",
        "click stray at 1600000000.000000005 s has the stamp of no frame",
    ),
    (
        2,
        "solve made.mcap --clicks outside.json --out o.json",
        "320 x 240 px; give the clicks of this recording, in its pixels, column first",
    ),
    (2, "solve made.mcap --clicks no-list.json --out o.json", "no-list.json: clicks"),
    (2, "solve made.mcap --clicks click.json", "click.json: no such file or folder; did you mean clicks.json?"),
    (
        2,
        "solve made.mcap --clicks good.json",
        "a cocalib/calibration-1 file, not cocalib/clicks-1; give it with --calib",
    ),
    (2, "solve made.mcap --clicks made.mcap/made.mcap.mcap", "not a text file but a recording; give it as RECORDING"),
    (2, "solve --pairs good.json --out good.json", "is also an input, which is never changed"),
    (2, "intrinsics camera.yaml --to ros --out camera.yaml", "is also an input, which is never changed"),
    (2, "show broken.mp4 --out broken.mp4", "is also an input, which is never changed"),
    (2, "solve --pairs pairs.xlsx --camera camera.yaml", "a spreadsheet; unpack it, or save it as CSV"),
    (2, "solve a.bag --propose --options camera.yaml", "not valid TOML"),
    (
        2,
        "check good.json --against good.json --max-deg 0,5",
        "takes DEG, as numbers like 0.5, without units, not '0,5'",
    ),
    (2, "solve made.mcap --clicks nothing", "nothing: is a folder, not a file of clicks or pairs; name a file in it"),
    (2, "solve made.mcap --clicks empty", "empty: the file is empty"),
    (2, "solve made.mcap --clicks clicks.json --camera word.yaml", "found no keys"),
    (2, "solve made.mcap --clicks clicks.json --out clicks.json", "is also an input, which is never changed"),
    (0, "solve made.mcap --clicks clicks.json --camera bare.yaml --out o.json", "bare.yaml states no distortion"),
    (1, "solve --pairs commas.csv --camera camera.yaml", "1 of at least 4"),
    (2, "solve --pairs camera.yaml --camera camera.yaml", "no columns u_px and v_px"),
    (2, "solve a.bag --clicsk=b.json", "unknown option --clicsk; did you mean --clicks"),
    (2, "solve a.bag --propose --auto", "--propose solves nothing: give a recording"),
    (2, "solve a.bag --json", "--json applies with --propose only"),
    (2, "solve a.bag --camera-position-m 0 1 4cm", "takes X Y Z, as numbers like 0.5, without units, not '0 1 4cm'"),
    (2, "solve a.bag --propose --camera-position-m 3 2 110", "Give meters: 0.11 or 1.1, if it is in mill"),
    (2, "solve a.bag --camera-position-by eye", "--camera-position-by"),
    (2, "solve a.bag --vehicle a/b", "--vehicle: 'a/b' cannot be a name; give one without slashes"),
    (2, "solve a.bag --session-name ..", "--session-name: '..' cannot be a name"),
    (2, "solve a.bag --vehicle-type ' '", "--vehicle-type is ' '; give 1 to 120 printable characters"),
    (2, "solve a.bag --radar-serial ''", "--radar-serial is ''; give 1 to 120 printable characters"),
    (2, f"solve a.bag --camera-serial {'x' * 121}", "--camera-serial is 'xxxxxxxxxxxxxxxxxxxx…'; give 1 to 120"),
    (2, "solve made.mcap --propose --reflector-m 24", "--reflector-m 24: give the width of the reflector"),
    (2, "solve made.mcap --auto --reflector-m nan", "--reflector-m nan: give the width of the reflector"),
    (2, "solve made.mcap --propose --out absent/made.json", "the folder absent does not exist"),
    (2, "solve made.mcap --auto --clicks-out absent/made.json", "the folder absent does not exist"),
    (2, "solve made.mcap --clicks-out made.json", "--clicks-out and --reflector-m apply with --auto only"),
    (2, "solve made.mcap --reflector-m 0.3", "--clicks-out and --reflector-m apply with --auto only"),
    (2, "solve made.mcap --auto --pairs p.json", "either a recording with --clicks or --auto, or --pairs"),
    (2, "solve made.mcap", "--auto to do without a person"),
    (2, "solve made.mcap --propose --clicks stray.json", "has the stamp of no frame"),
    (2, "solve a.bag --propose --set noise.sigmapx=3", "unknown option 'noise.sigmapx'; did you mean noise.sigma_px?"),
    (2, "solve a.bag --propose --set noise=3", "unknown option 'noise'"),
    (
        2,
        "solve a.bag --propose --set noise.sigma_px=many",
        "option noise.sigma_px: takes a number with a decimal",
    ),
    (2, "solve a.bag --propose --set noise.sigma_px", "--set noise.sigma_px: give NAME=VALUE"),
    (3, "solve --pairs good-pairs.json --method paper --out o.json --require usable", "next: "),
    (3, "solve --pairs mirrored.json --out o.json", "verdict: contradictory"),
    (0, "import good.json --out o.json", ""),
    (1, "import unclear.json --out o.json --camera camera.yaml", "Nothing was written: pick one, such as --as "),
    (1, "import unclear.json", "calibration.radar.T does not state what its numbers mean"),
    (2, "import empty", "empty: the file is empty"),
    (2, "import tf.sh --out o.json", "--camera FILE"),
    (
        2,
        "import tf.sh --as camera_from_radar,optical,m --out o.json --camera camera.yaml",
        "omit --as",
    ),
    (2, "import rig.json --out o.json --camera camera.yaml", "choose one with --pose NAME: 'front', 'rear'"),
    (2, "import good.json --out o.json --camera huge.json", "more than 100 digits"),
    (3, "import bare.txt --camera camera.yaml --out o.json", "note: taken as camera_from_radar,optical,m ("),
    (3, "import contradictory.json --out o.json", ""),
    (0, "evaluate good.json made.mcap --clicks clicks.json --no-held-out", "(AED) "),
    (1, "evaluate good.json made.mcap", "no clicks or boxes"),
    (2, "evaluate", "CALIBRATION is missing; see cocalib evaluate --help"),
    (2, "evaluate good.json", "evaluate needs a recording, or --report FILE.html"),
    (2, "evaluate good.json absent.mcap", "absent.mcap"),
    (
        2,
        "evaluate made.mcap good.json",
        "not a recording; give it with --calibration FILE (evaluate: as CALIBRATION, first)",
    ),
    (2, "evaluate good.json --boxes b.json --report a.html", "apply with a RECORDING only; give it after the"),
    (2, "evaluate /nowhere.json --report a.html", "/nowhere.json: "),
    (2, "evaluate good.json --report /nowhere/report.html", "/nowhere/report.html: the folder /nowhere does not exist"),
    (2, "evaluate good.json --report o.html --require max-deg 1", "--require max-deg: give a limit with its number"),
    (2, "evaluate good.json made.mcap --boxes clicks.json", "this is a cocalib/clicks-1 file, not a file of boxes"),
    (2, "evaluate good.json --report good.json", "is also an input, which is never changed"),
    (2, "evaluate good.json made.mcap --labels labels.json", "--labels applies to boxes"),
    (2, "evaluate good.json made.mcap --boxes missing.json", "missing.json"),
    (2, "evaluate good.json made.mcap --min-speed-mps -1", "--min-speed-mps: is -1"),
    (2, "evaluate good.json made.mcap --max-time-gap-s 99", "--max-time-gap-s: is 99"),
    (2, "evaluate golden.json made.mcap --report o.html", "for images of 640 x 480 px, but the recording's"),
    (2, "evaluate golden.json made.mcap", "for images of 640 x 480 px, but the recording's camera has 320 x 240 px"),
    (2, "watch", "CALIBRATION"),
    (2, "watch good.json", "RECORDING"),
    (2, "watch good.json absent.mcap", "absent.mcap"),
    (2, "watch good.json made.mcap --update o.json", "--update carries a change since a baseline, and there is no "),
    (2, "watch good.json made.mcap --baseline clicks.json", "clicks.json: "),
    (2, "watch good.json made.mcap --boxes absent.json", "absent.json: is neither a file nor a topic"),
    (3, "watch good.json made.mcap --baseline new-baseline.json", "baseline written to new-baseline.json"),
    (3, "evaluate contradictory.json made.mcap --clicks clicks.json --no-held-out", ""),
    (3, "evaluate bare.txt made.mcap --clicks clicks.json --no-held-out --require usable", ""),
    (0, "evaluate good.json --report o.html", ""),
    (2, "evaluate empty --report o.html", "empty"),
    (3, "evaluate good.json --report o.html --require max-deg=0.001", ""),
    (3, "evaluate contradictory.json --report o.html", ""),
    (0, "check good.json", "ok: "),
    (2, "check good.json --against good.json", "is the checked file itself"),
    (0, "check contradictory.json --of contradictory.json", "ok: the pose is that calibration's"),
    (1, "check good.json --against turned.txt", "DIFFERS: "),
    (1, "check turned.txt --against good.json --recording made.mcap", ""),
    (2, "check", "CALIBRATION is missing; see cocalib check --help"),
    (2, "check absent.json", "absent.json"),
    (2, "check made.mcap/made.mcap.mcap --against good.json", "not a text file but a recording; give it as RECORDING"),
    (2, "check camera.yaml", "give intrinsics with --camera FILE"),
    (2, "check empty", "empty"),
    (2, "check a.json --max-deg 1", "are limits for --against FILE"),
    (2, "check a.json --clicks clicks.json", "give it with --recording RECORDING"),
    (2, "check a.json --radar-topic /r", "apply with --recording RECORDING only"),
    (2, "check a.json b.json --against c.json --recording d", "judges two calibrations"),
    (2, "check tf.sh --recording made.mcap", "give --clicks CLICKS.json"),
    (3, "check bare.txt", "not proven"),
    (3, "check contradictory.json", ""),
    (0, "batch good.toml", "1 session: 1 solved"),
    (2, "batch absent.toml", "no such file"),
    (2, "batch status", "batch status takes OUT"),
    (2, "batch status absent", "absent: no such folder"),
    (2, "batch status nothing", "no results"),
    (2, "batch status OUT --workers 2", "batch status takes --json or --csv FILE"),
    (2, "batch status OUT --json --csv a", "batch status takes --json or --csv FILE"),
    (2, "batch walk OUT", "batch takes one MANIFEST, or status OUT"),
    (2, "batch unrun.toml --json", "batch takes one MANIFEST, or status OUT"),
    (2, "batch unrun.toml --workers 2 --scheduler tcp://127.0.0.1:1", "give one of them"),
    (2, "batch unrun.toml --workers 0", "there must be at least 1"),
    (2, "batch unrun.toml --scheduler tcp://10.0.0.7:8786", "without TLS is refused"),
    (2, "batch good.toml --scheduler host:8786", "not an address of a Dask scheduler"),
    (2, "batch sessions.csv", "[[session]]"),
    (11, "batch broken.toml", "2 sessions: 1 solved, 1 refused"),
    (0, "export", "mcap "),
    (0, "export good.json --to tf2", "static_transform_publisher"),
    (3, "export contradictory.json --to tf2", "--despite-verdict"),
    (3, "export contradictory.json --to all --out formats", "--despite-verdict"),
    (0, "export contradictory.json --to tf2 --despite-verdict", "verdict: contradictory"),
    (2, "export bare.txt --to tf2", "not calibration-1"),
    (
        2,
        "export tf.sh --to urdf",
        "tf.sh: is tf2, not calibration-1; convert it first: cocalib import tf.sh --out calibration.json",
    ),
    (2, "export absent.json --to tf2", "absent.json"),
    (2, "export good.json tf2", "did you mean --to tf2?"),
    (2, "export a.json --to URDF", "did you mean urdf?"),
    (2, "export a.json --format tf2", "unknown option --format; did you mean --to?"),
    (2, "export clicks.json --to tf2", "a cocalib/clicks-1 file, not a calibration; give them with their recording"),
    (2, "export good.json --to urdf --out good.json", "is also an input, which is never changed"),
    (2, "export good.json --to urdf --out word.yaml", "holds something else, which is not overwritten"),
    *((0, f"export good.json --to {to} --out {to}", "") for to in 2 * ("urdf", "matlab", "matrix", "colmap")),
    (2, "export a.json --to tf1-launch", "unknown format 'tf1-launch'"),
    (
        2,
        "export golden.json --to kitti",
        "kitti comes with rectification.npz and needs a file or folder: --out calib.txt",
    ),
    (2, "export good.json --to opencv --rectified", "rectified"),
    (2, "export good.json --to autoware --parent-from-radar 0 0 0 0 0 0 2", "qw last"),
    (2, "export good.json --to tf2 --radar a$b", "use a name without"),
    (2, "export good.json --to all", "--out"),
    (2, "export good.json --to all --out empty", "--to all needs a folder: --out FOLDER"),
    (2, "export good.json --to all --out empty/inside", "empty"),
    (2, "export good.json --to mcap", "--recording RECORDING... --out NEW.mcap"),
    (2, "export good.json --to mcap --recording made.mcap --out new.bag", "name it NAME.mcap"),
    (2, "export good.json --to mcap --recording made.mcap --out o.mcap --rectified", "do not apply to --to mcap"),
    (2, "export good.json --to mcap --recording nothing.bag --out o.mcap", "no such file"),
    (2, "export good.json --to mcap --recording made.mcap --out no/folder/o.mcap", "does not exist; create it"),
    (2, "export good.json --to mcap --recording images --out o.mcap", "is no ROS recording"),
    (0, "show made.mcap --out o.mp4", "o.mp4: 161 frames, 80.000 s, from 1700000000.000000000 s"),
    (2, "show absent.mcap", ""),
    (2, "show absent.mcap --out o.mp4", "absent.mcap"),
    (2, "show a.bag --out a.mp4 --trail 3", "--calibration FILE is missing"),
    (2, "show made.mcap --out o.rrd", "--calibration FILE is missing"),
    (2, "show made.mcap --out o.mp4 --calibration good.json --trail -1", "--trail -1: give a number of scans"),
    (2, "show made.mcap --calibration good.json --out o.mcap", "o.mcap"),
    (2, "show made.mcap --calibration absent.json --out o.rrd", "absent.json"),
    (
        2,
        "show made.mcap --calibration golden.json --out o.rrd",
        "its images have 320 x 240 px, but the calibration's camera",
    ),
    (
        2,
        "show still.mcap --calibration good.json --colour speed --out o.mp4",
        "use --colour range",
    ),
    (0, "info made.mcap", "/camera/image/compressed"),
    (0, "info no-radar.mcap", "no readable topic"),
    (1, "info cut.mcap --verify", ""),
    (2, "info", "no recording given"),
    (2, "info empty", "empty"),
    (2, "info absent.bag", "absent.bag"),
    (2, "info http://robot/a.bag", "copy it to this machine first"),
    (2, "info a.bag --bogus", "unknown option --bogus; see cocalib info --help"),
    (2, "info a.bag --topic /radar", "did you mean --camera-info-topic, --image-topic or --radar-topic?"),
    (2, "info a.bag --clock wall", "--clock takes auto, header or receive, not 'wall'"),
    *((2, f"info made.mcap --radar-topic '{name}'", "no topic") for name in ("", "  ", ",")),
    *(
        (code, f"solve {how} {recording}.mcap --out o.json", words)
        for how in ("--propose", "--auto")
        for code, recording, words in (
            (2, "no-radar", "radar"),
            (2, "no-images", "image"),
            (2, "no-camera", "no intrinsics for /camera/image/compressed"),
            (1, "two", "The radar shows 1 placement, "),
            (1, "still", "placements"),
        )
    ),
    (1, "solve --propose still.mcap", "None of the 7 placements shows "),
    (2, "solve --propose absent.mcap", "absent.mcap"),
    (2, "intrinsics", "SOURCE is missing"),
    (2, "intrinsics absent.png --board 9x6 --square-mm 25", "no such file or folder"),
    (2, "intrinsics left*.jpg --board 9x6 --square-mm 25", "nothing has such a name"),
    (2, "intrinsics nothing --board 9x6 --square-mm 25", "contains no recording"),
    (2, "intrinsics no-images.mcap --board 9x6 --square-mm 25", "image"),
    (
        2,
        "intrinsics grey.png made.mcap --board 9x6 --square-mm 25",
        "2 sources of different kinds (grey.png: an image, ",
    ),
    (2, "intrinsics broken.mp4 --board 9x6 --square-mm 25", "not a readable video"),
    (2, "intrinsics grey.png", "--board 9x6 and --square-mm 25"),
    (2, "intrinsics grey.png --board 9x6 --square-mm 25 --image-topic /c", "--image-topic /c applies to a recording"),
    (2, "intrinsics grey.png --board 9x6 --square-mm 25 --marker-mm 3", "checkerboard has none"),
    (2, "intrinsics grey.png --board 9x6 --square-mm 25 --report o.pdf", "NAME.html"),
    (2, "intrinsics grey.png --board 9x6 --square-mm 25 --out no/camera.yaml", "does not exist"),
    (0, "intrinsics camera.yaml --to kalibr", "radtan"),
    (2, "intrinsics camera.yaml --rescale 320x320", "another aspect ratio"),
    (2, "intrinsics camera.yaml --to kalib", "did you mean kalibr?"),
    (2, "intrinsics clicks.json --board 9x6 --square-mm 25", "give the recording, video or images of the board"),
    (2, "intrinsics camera.yaml --board 9x6 --square-mm 25", "is a file with intrinsics"),
    (0, "session list nothing", "no sessions here or in your user folder"),
    (2, "session list absent", "absent: no such"),
    (2, "session list --yes", "--yes applies to session repair only"),
    (2, "session list --out b", "--out applies to session export only"),
    (2, "session export a", "needs the name of the new file: --out clicks.json"),
    (2, "session export absent --out o.json", "absent"),
    (2, "session export --out b", "takes one session folder, or its recording; 0 given"),
    (2, "session repair a b", "takes one session folder, or its recording; 2 given"),
    (2, "session repair a --json", "--json applies to session list only"),
    (2, "session repair absent", "absent: no such folder"),
    (2, "session repair grey.png", "has no session next to it"),
    (2, "session repair empty.cocalib-session", "holds no session"),
    (2, "session mend", "takes list, repair or export, not 'mend'"),
    (2, "simulate --out absent --preset Unkind", "--preset Unkind: did you mean unkind?"),
    (2, "simulate --out absent --set radar=ti", "option radar: takes "),
    (2, "simulate --out absent --rig.camera-angles-deg 0 2 0", "unknown option --rig.camera-angles-deg"),
    (2, "simulate absent", "unexpected argument 'absent'; did you mean --out absent?"),
    (2, "open --absent", "unknown option --absent"),
    (2, "open absent.bag --no-browser", "absent.bag"),
    (2, "open empty --no-browser --port 0", "empty"),
    (2, "open a.bag --port http", "--port takes a whole number, not 'http'"),
    (2, "open --no-browser", "no recording given"),
    (2, "open --follow --no-browser", "no recording given"),
    (2, "demo a.bag", "for your own recording: cocalib open a.bag"),
    (2, "demo --absent", "unknown option --absent"),
    (2, "demo --no-browser --port 99999", "65535"),
    (2, "demo --no-browser --host 203.0.113.5", "203.0.113.5"),
    (2, "demo --no-browser --token ''", "empty"),
    (2, "bogus", "unknown command 'bogus'; known: demo, open"),
    (2, "calibrate a.bag", "unknown command 'calibrate'; did you mean solve?"),
    (2, "convert a.json", "unknown command 'convert'; did you mean export?"),
    (2, "infos a.bag", "did you mean info?"),
    (2, "--json info", "unknown option --json; give a command first: demo, open"),
]


def _noisy_pairs(points_radar_m: np.ndarray) -> str:
    """Write pairs with noise of a pixel."""
    pixels = _MADE.camera.project(_MADE.camera_from_radar @ _MADE.positions_radar_m)
    pixels += np.random.default_rng(3).normal(0.0, 1.0, pixels.shape)
    names = (f"p{index}" for index in range(len(points_radar_m)))
    return pairs_text(_MADE.camera, zip(names, points_radar_m, pixels, strict=False))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, project_root: Path) -> Path:
    """The files of the table."""
    path = tmp_path_factory.mktemp("codes")
    recordings = {
        "made": _MADE,
        "two": Made(placements=2),
        "no-radar": Made(with_radar=False),
        "no-camera": Made(with_camera_info=False),
        "no-images": Made(with_images=False),
        "still": Made(with_speeds=False),
    }
    for name, recorded in recordings.items():
        write_ros2(path / f"{name}.mcap", recorded.messages(), container="mcap")
    (file,) = (path / "made.mcap").glob("*.mcap")
    (path / "cut.mcap").write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    document = json.loads(_MADE.clicks())
    first, *others = document["clicks"]
    stray = {"id": "stray", "image_time": {"sec": 1_600_000_000, "nanosec": 5}, "pixel_px": [10, 10]}
    for name, clicks in {
        "clicks": document["clicks"],
        "three": document["clicks"][:3],
        "stray": [stray],
        "outside": [*others, first | {"pixel_px": [320.0, 5.0]}],
        "off": [
            one | {"pixel_px": np.add(one["pixel_px"], (0, 60 * (one["id"] == "c5"))).tolist()}
            for one in [first, *others]
        ],
        "no-list": "none",
    }.items():
        (path / f"{name}.json").write_text(json.dumps(document | {"clicks": clicks}))
    for name in ("nothing", "empty.cocalib-session", "images"):
        (path / name).mkdir()
    for name in ("grey.png", "images/1700000000.000000.jpg", "images/1700000001.000000.jpg"):
        cv2.imwrite(str(path / name), np.full((240, 320), 90, np.uint8))
    (path / "broken.mp4").write_bytes(b"not a video")
    (path / "pairs.csv").write_text("x_m,y_m,z_m,u_px,v_px\n1,2,3,4,5\n")
    shutil.copy(project_root / "tests" / "golden" / "calibration-1.json", path / "golden.json")
    (path / "empty").write_bytes(b"")
    points_radar_m = _MADE.positions_radar_m
    (path / "good-pairs.json").write_text(_noisy_pairs(points_radar_m))
    (path / "misspelt.json").write_text(_noisy_pairs(points_radar_m).replace("pixel_px", "pixl_px"))
    (path / "few.json").write_text(_noisy_pairs(points_radar_m[:2]))
    (path / "mirrored.json").write_text(_noisy_pairs(points_radar_m * [1.0, -1.0, 1.0]))
    for pairs, out in (("good-pairs", "good"), ("mirrored", "contradictory")):
        flags = ["--pairs", str(path / f"{pairs}.json"), "--camera-position-m", *_POSITION_M]
        run(["solve", *flags, "--out", str(path / f"{out}.json")])
    pose = _MADE.camera_from_radar
    np.savetxt(path / "bare.txt", pose.as_matrix())
    np.savetxt(path / "turned.txt", pose.perturbed(np.array([0.0, 0.0, 0.0, 0.0, 0.2, 0.0])).as_matrix())
    matrix, size = (
        _MADE.camera.matrix_px,
        f"image_width: {_MADE.camera.width_px}\nimage_height: {_MADE.camera.height_px}",
    )
    (path / "camera.yaml").write_text(
        f"{size}\ndistortion_model: plumb_bob\ncamera_matrix: {{rows: 3, cols: 3, data: {matrix.ravel().tolist()}}}\n"
        f"distortion_coefficients: {{rows: 1, cols: 4, data: {_MADE.camera.distortion.tolist()}}}\n"
    )
    (path / "bare.yaml").write_text(f"{size}\ncamera_matrix: {{rows: 3, cols: 3, data: {matrix.ravel().tolist()}}}\n")
    (path / "pairs.xlsx").write_bytes(b"PK\3\4\xff")
    (path / "word.yaml").write_text("hello")
    (path / "commas.csv").write_text("x;y;z;u;v\n5,0;1,0;0,1;100,5;90,0\n")
    body = (pose.inverse() @ RigidTransform(OPTICAL_FROM_LINK, np.zeros(3))).as_matrix()
    (path / "unclear.json").write_text(json.dumps({"calibration": {"radar": {"T": body.tolist()}}}))
    (path / "rig.json").write_text(json.dumps(dict.fromkeys(("front", "rear"), pose.as_matrix().tolist())))
    huge = {"image_width": 10**400, "image_height": 240, "camera_matrix": matrix.ravel().tolist()}
    (path / "huge.json").write_text(json.dumps(huge))
    run(["export", str(path / "good.json"), "--to", "tf2", "--out", str(path / "tf.sh")])
    row = '[[session]]\nvehicle = "a"\nrecording = "made.mcap"\nclicks = "clicks.json"\n'
    (path / "good.toml").write_text(row)
    (path / "unrun.toml").write_text(row.replace("made.mcap", "absent.bag"))
    (path / "broken.toml").write_text(row + '[[session]]\nvehicle = "b"\nrecording = "cut.mcap"\n')
    return path


@pytest.mark.parametrize(("code", "typed", "words"), _TABLE, ids=[typed for _, typed, _ in _TABLE])
def test_every_command_line_ends_with_its_code_and_its_words(code, typed, words, folder, cocalib, monkeypatch):
    if typed.startswith("show"):
        pytest.importorskip("av", reason="the extra 'video' is not installed")
        pytest.importorskip("rerun", reason="there is no wheel of rerun-sdk for this machine")
    monkeypatch.chdir(folder)
    monkeypatch.setenv("XDG_STATE_HOME", str(folder / "state"))
    monkeypatch.setattr(chance, "_DEALS", 5)  # how far chance goes is not what is tested here
    before = {path: path.stat().st_mtime_ns for path in folder.iterdir() if path.is_file()}
    answer = cocalib(*shlex.split(typed))
    assert answer.code == code, answer.out + answer.err
    assert words in answer.out + answer.err
    if code in (1, 2):
        after = {path: path.stat().st_mtime_ns for path in folder.iterdir() if path.is_file()}
        assert after == before, "what is refused changes no file"
    if code == 2:
        assert answer.out == ""
        assert answer.err.splitlines()[-1].startswith("cocalib: ")


def test_the_table_has_every_command():
    assert {typed.split()[0] for _, typed, _ in _TABLE} >= set(COMMANDS)


@pytest.mark.parametrize(
    ("levels", "require", "code"),
    [
        (["good", "usable"], "usable", 0),
        (["contradictory"], None, 0),
        (["contradictory", "good"], "usable", 11),
        (["good", "usable", None], "good", 12),
        ([None] * 200, None, 99),
    ],
)
def test_a_batch_counts_what_failed(levels, require, code):
    assert batch_exit_code(levels, require) == code


@pytest.mark.parametrize("command", ["check", "export"])
def test_the_verdict_of_a_file_is_said(command, folder, cocalib):
    flags = ["--to", "tf2"] if command == "export" else []
    for name in ("good", "contradictory"):
        verdict = json.loads((folder / f"{name}.json").read_text())["verdict"]
        answer = cocalib(command, folder / f"{name}.json", *flags)
        assert verdict["reason"] in answer.out + answer.err


def test_help_states_the_law_of_exit_codes(cocalib):
    assert exit_codes() in " ".join(cocalib("--help").out.split())
