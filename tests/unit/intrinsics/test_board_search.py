"""The search: which images are looked at, which views are chosen, and what is said about the others."""

import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import cv2
import msgspec
import numpy as np
import pytest

from benchmarks.boards import BoardFilm, render_board, true_corners
from calib_core.camera import Camera, CameraModel
from calib_core.errors import InputError, RecordingError
from calib_core.intrinsics import board_search
from calib_core.intrinsics.board import Board, board_of_size
from calib_core.intrinsics.board_detection import blur_px, board_in, find_board
from calib_core.intrinsics.board_search import ImageOrder, search_boards
from calib_core.intrinsics.coverage import BoardSearch, SearchProgress
from calib_core.measurements import TimeNs, Unsolvable
from calib_core.synthetic.boards import waved_poses
from calib_core.synthetic.rig import typical_camera

BOARD = Board("checkerboard", 5, 4, 0.03)


def drawn(
    shift: float = 0.0, *, tilt: float = 0.0, board: Board = BOARD, size: tuple[int, int] = (320, 240)
) -> np.ndarray:
    """Draw a board; it moves to the right with the shift [px] and turns with the tilt."""
    squares = np.add.outer(np.arange(board.rows + 1), np.arange(board.columns + 1)) % 2
    flat = np.kron(np.where(squares, 30, 220), np.ones((40, 40))).astype(np.uint8)
    flat = cv2.copyMakeBorder(flat, 40, 40, 40, 40, cv2.BORDER_CONSTANT, value=220)
    height, width = flat.shape
    before = np.float32([[0, 0], [width, 0], [width, height], [0, height]])
    after = before * 0.55 + np.float32([10 + shift, 15])
    after[1] += [-20 * tilt, 15 * tilt]
    after[2] += [-20 * tilt, -15 * tilt]
    shown = cv2.warpPerspective(flat, cv2.getPerspectiveTransform(before, after), size, borderValue=120)
    return cv2.cvtColor(cv2.GaussianBlur(shown, (0, 0), 0.7), cv2.COLOR_GRAY2BGR)


@dataclass
class Drawn:
    """Images that are drawn when they are asked for."""

    draw: list[Callable[[], np.ndarray]]
    rate_hz: float | None = None
    asked: list[int] = field(default_factory=list)

    def __len__(self) -> int:
        return len(self.draw)

    def name(self, index: int, /) -> str:
        return f"image {index}"

    def time_ns(self, index: int, /) -> TimeNs | None:
        return None if self.rate_hz is None else TimeNs(round(index * 1e9 / self.rate_hz))

    def image(self, index: int, /) -> np.ndarray:
        self.asked.append(index)
        return self.draw[index]()


def several() -> list[Callable[[], np.ndarray]]:
    return [lambda s=s, t=t: drawn(s, tilt=t) for s, t in ((0, 0.0), (25, 0.5), (50, 1.0), (60, 1.5), (10, 1.3))]


def searched(images: Drawn, board: Board = BOARD) -> BoardSearch:
    search = search_boards(images, board)
    assert isinstance(search, BoardSearch), search
    return search


def test_every_image_of_a_few_is_searched_and_every_good_one_chosen():
    told: list[SearchProgress] = []
    search = search_boards(Drawn(several()), BOARD, progress=told.append)
    assert [view.index for view in search.views] == [0, 1, 2, 3, 4]
    assert search.complete
    assert search.left_out == ()
    assert [one.searched for one in told] == [1, 2, 3, 4, 5]
    assert told[-1].coverage.counts.sum() == 100


def test_what_is_not_used_is_named_with_the_reason():
    def unreadable() -> np.ndarray:
        raise RecordingError("the file is cut off")

    other = Board("checkerboard", 7, 5, 0.03)
    odd = [
        lambda: cv2.GaussianBlur(drawn(25, tilt=0.5), (0, 0), 3.0),
        lambda: cv2.GaussianBlur(drawn(50, tilt=1.0), (0, 0), 0.8),
        unreadable,
        lambda: np.full((240, 320, 3), 90, dtype=np.uint8),
        lambda: drawn(-10, board=other),
    ]
    search = searched(Drawn([*several(), *odd]))
    assert [view.index for view in search.views] == [0, 1, 2, 3, 4]
    reasons = {one.index: one.reason for one in search.left_out}
    assert reasons[5].startswith("blurred: edges are ")
    assert "view as image 2" in reasons[6]
    assert "cut off" in reasons[7]
    assert "as a whole" in reasons[8]
    assert "7 x 5" in reasons[9]


@pytest.mark.parametrize(
    ("draw", "why"),
    [
        (
            [lambda: np.zeros((240, 320, 3), np.uint8)] * 3,
            Unsolvable("no-board", {"board": BOARD, "searched": 3, "views": 0}),
        ),
        (
            [lambda: drawn(board=Board("checkerboard", 6, 4, 0.03))] * 3,
            Unsolvable(
                "other-board",
                {"board": BOARD, "searched": 3, "views": 0, "corners": (6, 4), "shown": 3, "asked": 3},
            ),
        ),
        (
            [*several(), *[lambda: drawn(size=(330, 250))] * 3],
            Unsolvable("mixed-sizes", {"counts": (((320, 240), 5), ((330, 250), 3))}),
        ),
        ([], Unsolvable("no-pictures")),
    ],
)
def test_a_search_without_a_result_says_why(draw, why):
    assert search_boards(Drawn(draw), BOARD) == why


def test_a_few_images_of_another_size_are_named_and_the_rest_is_used():
    search = searched(Drawn([*several(), lambda: drawn(size=(330, 250))]))
    assert len(search.views) == 5
    assert re.findall(r"\d+", search.left_out[0].reason) == ["330", "250", "320", "240"]


def test_a_cancelled_search_goes_on_where_it_ended():
    first = Drawn(several())
    told: list[SearchProgress] = []
    part = search_boards(first, BOARD, progress=told.append, stopped=lambda: len(told) == 2)
    assert not part.complete
    again = Drawn(several())
    whole = search_boards(again, BOARD, known=told[-1])
    assert isinstance(whole, BoardSearch)
    assert sorted(again.asked) == sorted(set(range(5)) - set(told[-1].indices))
    assert [view.index for view in whole.views] == [0, 1, 2, 3, 4]
    assert whole.complete


def test_a_long_recording_is_searched_where_the_board_is(monkeypatch):
    shown = range(30_000, 31_800)  # a minute of half an hour

    def find(image: np.ndarray, board: Board) -> tuple[np.ndarray, np.ndarray] | None:
        number = int(image[0, 0, 0])
        return (np.arange(20), board.corners_m[:, :2] * 1e3 + [number % 97, number % 89]) if number in shown else None

    monkeypatch.setattr(board_search, "find_board", find)
    monkeypatch.setattr(board_search, "blur_px", lambda *_: 1.0)
    draw = [lambda index=index: np.full((4, 4, 1), index, dtype=np.int64) for index in range(54_000)]
    images = Drawn(draw, rate_hz=30.0)
    search = searched(images)
    assert len(images.asked) <= 420
    assert len([index for index in images.asked if index in shown]) > 100
    assert 30 <= len(search.views) <= 60
    assert not any("as a whole" in one.reason for one in search.left_out)


@pytest.mark.slow
def test_a_search_for_a_board_that_is_another_one_ends_early():
    other = Board("checkerboard", 6, 4, 0.03)
    images = Drawn([lambda: drawn(board=other)] * 100)
    found = search_boards(images, BOARD)
    assert found.code == "other-board"
    assert len(images.asked) < 50


def test_one_image_that_seems_to_show_the_board_does_not_hide_that_the_others_show_another():
    other = Board("checkerboard", 6, 4, 0.03)
    found = search_boards(Drawn([drawn, *[lambda s=s: drawn(4.0 * s, board=other) for s in range(7)]]), BOARD)
    assert found.code == "other-board"
    assert (found.facts["searched"], found.facts["views"], found.facts["corners"]) == (8, 1, (6, 4))


def test_a_copy_of_a_image_is_the_same_view_and_no_less_sharp():
    search = searched(Drawn([*several(), several()[2]]))
    assert [(one.index, one.reason.endswith("image 2")) for one in search.left_out] == [(5, True)]


def test_the_first_images_of_a_long_recording_are_far_apart():
    order = ImageOrder(54_000, lambda index: TimeNs(index * 33_333_333))
    first = order.next_batch(())[:8]
    assert min(abs(a - b) for number, a in enumerate(first) for b in first[:number]) > 4_000
    assert order.next_batch(()) == []
    assert ImageOrder(0, lambda _: None).next_batch(()) == []


# Boards in rendered images, whose corners are known.


CHECKERBOARD = Board("checkerboard", 9, 6, 0.02214)
CHARUCO = Board("charuco", 10, 7, 0.0225, 0.0168, "DICT_5X5_100")
APRILGRID = Board("aprilgrid", 6, 4, 0.03, 0.009, "DICT_APRILTAG_36h11")
FILM = BoardFilm(blur_px=0.7, noise_grey=2.0)


def camera_of(model: CameraModel = "plumb_bob") -> Camera:
    return typical_camera(model, width_px=1280, height_px=720)


def views(board: Board, film: BoardFilm, count: int, model: CameraModel = "plumb_bob", seed: int = 3):
    """Yield images and the true corners of each by id."""
    camera = camera_of(model)
    for number, pose in enumerate(waved_poses(np.random.default_rng(seed), board, camera, count)):
        yield render_board(board, camera, pose, film, seed=number), true_corners(board, camera, pose, film)


def apart(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Return how far corners are from the truth, counted from whichever end of a checkerboard."""
    return min((found - true, found - true[::-1]), key=lambda difference: float(np.abs(difference).sum()))


@pytest.mark.slow
@pytest.mark.parametrize("model", ["plumb_bob", "equidistant"])
def test_corners_of_a_checkerboard_are_found_to_three_hundredths_of_a_pixel(model):
    errors = []
    for image, true in views(CHECKERBOARD, FILM, 5, model):
        found = find_board(image, CHECKERBOARD)
        errors.append(apart(found[1], true))
    assert np.sqrt(np.mean(np.square(errors))) < 0.03
    assert np.abs(errors).max() < 0.2


@pytest.mark.slow
def test_light_that_falls_off_to_one_side_does_not_move_corners():
    film = replace(FILM, gradient=(0.35, -0.2), vignetting=0.4)
    errors = [
        apart(found[1], true)
        for image, true in views(CHECKERBOARD, film, 4)
        if (found := find_board(image, CHECKERBOARD))
    ]
    assert len(errors) == 4
    assert np.sqrt(np.mean(np.square(errors))) < 0.02
    assert np.abs(np.mean(np.concatenate(errors), axis=0)).max() < 0.006


@pytest.mark.parametrize("board", [CHARUCO, APRILGRID], ids=["charuco", "aprilgrid"])
def test_boards_with_markers_say_which_corner_is_which(board):
    for image, true in views(board, FILM, 2):
        found = find_board(image, board)
        assert found is not None
        ids, pixels = found
        assert len(ids) > 0.7 * len(true)
        assert (np.diff(ids) > 0).all()
        assert np.sqrt(np.mean(np.square(pixels - true[ids]))) < 0.04
        assert np.abs(pixels - true[ids]).max() < 0.4


def test_tags_whose_outline_runs_into_the_squares_between_them_get_their_corners():
    """In small images the outline of a tag ends pixels away from its corner, for a third of the corners at once."""
    board = Board("aprilgrid", 6, 6, 0.03, 0.009, "DICT_APRILTAG_36h11")
    camera = typical_camera("plumb_bob", width_px=640, height_px=480)
    poses = list(waved_poses(np.random.default_rng(3), board, camera, 12))
    for number in (0, 9):
        image = render_board(board, camera, poses[number], FILM, seed=number)
        found = find_board(image, board)
        assert found is not None
        ids, pixels = found
        assert len(ids) >= 36
        assert np.abs(pixels - true_corners(board, camera, poses[number], FILM)[ids]).max() < 0.4


@pytest.mark.parametrize("board", [CHARUCO, APRILGRID], ids=["charuco", "aprilgrid"])
def test_a_part_of_a_board_with_markers_suffices(board):
    image, true = next(views(board, FILM, 1))
    hidden = image.copy()
    hidden[:, : int(np.median(true[:, 0]))] = 120
    whole, part = find_board(image, board), find_board(hidden, board)
    assert 6 <= len(part[0]) < len(whole[0])
    assert np.abs(part[1] - true[part[0]]).max() < 0.5


def test_a_grid_of_opencvs_tags_is_found_though_they_are_turned():
    board = Board("aprilgrid", 3, 2, 0.05, 0.015, "DICT_APRILTAG_36h11")
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    image = np.full((500, 700), 255, dtype=np.uint8)
    corners = board.corners_m[:, :2] * 3000.0 + 80.0
    for tag in range(6):
        left, top = corners[4 * tag].round().astype(int)
        image[top : top + 150, left : left + 150] = cv2.aruco.generateImageMarker(dictionary, tag, 150, borderBits=2)
    found = find_board(image, board)
    assert len(found[0]) == 24
    assert np.abs(found[1] - (corners[found[0]] - 0.5)).max() < 1.0


def test_a_checkerboard_is_numbered_with_a_right_hand():
    image, _ = next(views(CHECKERBOARD, FILM, 1))
    for shown in (image, cv2.rotate(image, cv2.ROTATE_90_CLOCKWISE), cv2.rotate(image, cv2.ROTATE_180)):
        found = find_board(shown, CHECKERBOARD)
        grid = found[1].reshape(6, 9, 2)
        along, down = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
        assert along[0] * down[1] - along[1] * down[0] > 0.0


def test_a_large_image_is_searched_small_and_refined_large():
    camera = typical_camera("plumb_bob", width_px=2560, height_px=1440)
    pose = waved_poses(np.random.default_rng(4), CHECKERBOARD, camera, 1)[0]
    found = find_board(render_board(CHECKERBOARD, camera, pose, FILM, seed=1), CHECKERBOARD)
    assert np.abs(apart(found[1], true_corners(CHECKERBOARD, camera, pose, FILM))).max() < 0.15


@pytest.mark.slow
def test_a_part_of_a_larger_board_is_not_the_board():
    image, _ = next(views(CHECKERBOARD, FILM, 1))
    for columns, rows in ((8, 6), (10, 7)):
        assert find_board(image, msgspec.structs.replace(CHECKERBOARD, columns=columns, rows=rows)) is None
    assert board_in(image, msgspec.structs.replace(CHECKERBOARD, columns=10, rows=7)) == (9, 6)
    assert board_in(image, CHECKERBOARD) is None


def test_no_board_is_found_where_there_is_none():
    noise = np.random.default_rng(1).integers(0, 255, (480, 640, 3), dtype=np.uint8)
    stripes = np.tile(np.repeat(np.array([20, 230], dtype=np.uint8), 20), (480, 16))
    for image in (noise, stripes, np.zeros((480, 640, 3), dtype=np.uint8)):
        for board in (CHECKERBOARD, CHARUCO, APRILGRID):
            assert find_board(image, board) is None
        assert board_in(image, CHECKERBOARD) is None


@pytest.mark.parametrize("board", [CHECKERBOARD, CHARUCO, APRILGRID], ids=["checkerboard", "charuco", "aprilgrid"])
def test_blur_is_measured_in_pixels(board):
    measured = []
    for blur in (0.7, 1.4, 2.0):
        image, true = next(views(board, BoardFilm(blur_px=blur), 1))
        measured.append(blur_px(image, np.arange(len(true)), true, board))
    assert measured == sorted(measured)
    known = 3 if board is CHECKERBOARD else 1  # markers leave less room beside an edge than strong blur takes
    np.testing.assert_allclose(measured[:known], np.hypot([0.7, 1.4, 2.0], 0.5)[:known], rtol=0.2)


def test_motion_blurs_the_edges_across_it():
    image, true = next(views(CHECKERBOARD, FILM, 1))
    ids = np.arange(len(true))
    still = blur_px(image, ids, true, CHECKERBOARD)
    moved = cv2.blur(image, (9, 1))
    assert blur_px(moved, ids, true, CHECKERBOARD) > 1.8 * still
    assert np.isnan(blur_px(np.full_like(image, 90), ids, true, CHECKERBOARD))


# Boards: where their corners are, and how they are named.


def test_a_checkerboard_is_named_by_its_inner_corners():
    board = board_of_size(" 9X6 ", 22.14)
    assert (board.columns, board.rows, board.square_m) == (9, 6, 0.02214)
    np.testing.assert_allclose(board.corners_m[10], [0.02214, 0.02214, 0.0])
    assert len(board.corners_m) == 54


def test_a_grid_counts_its_tags_from_the_lower_left_and_their_corners_clockwise():
    board = board_of_size("3x2", 50.0, "aprilgrid", tag_spacing=0.2)
    corners = board.corners_m[:, :2]
    np.testing.assert_allclose(corners[:4], [[0.0, 0.06], [0.05, 0.06], [0.05, 0.11], [0.0, 0.11]], atol=1e-12)
    np.testing.assert_allclose(corners[4] - corners[0], [0.06, 0.0], atol=1e-12)
    np.testing.assert_allclose(corners[12] - corners[0], [0.0, -0.06], atol=1e-12)


@pytest.mark.parametrize(
    "board",
    [
        Board("checkerboard", 5, 4, 0.03),
        Board("charuco", 5, 4, 0.03, 0.02, "DICT_5X5_100"),
        Board("aprilgrid", 3, 2, 0.03, 0.01, "DICT_APRILTAG_36h11"),
    ],
)
def test_edges_are_as_long_as_a_square(board):
    ends = board.corners_m[board.edges]
    np.testing.assert_allclose(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1), 0.03)
    assert len({tuple(sorted(edge)) for edge in board.edges.tolist()}) == len(board.edges)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("9", 22.0), "inner corners along a row .* such as 9x6"),
        (("9x", 22.0), "inner corners"),
        (("1x6", 22.0), "inner corners"),
        (("3x2", 22.0), "too few corners"),
        (("9x6", 0.0), "side of a square in millimeters"),
        (("9x6", float("nan")), "side of a square in millimeters"),
        (("2x2", 22.0, "charuco"), "squares along a row"),
    ],
)
def test_what_is_no_board_is_refused(arguments, words):
    with pytest.raises(InputError, match=words):
        board_of_size(*arguments)


@pytest.mark.parametrize(
    ("kind", "given", "words"),
    [
        ("charuco", {"marker_mm": 30.0}, "a marker is smaller than its square"),
        ("charuco", {"dictionary": "DICT_9X9"}, "not one of OpenCV's"),
        ("charuco", {"tag_spacing": 0.3}, "a charuco has none"),
        ("checkerboard", {"marker_mm": 10.0}, "a checkerboard has none"),
        ("aprilgrid", {"tag_spacing": 0.0}, "gap between two tags"),
    ],
)
def test_what_belongs_to_another_board_is_refused(kind, given, words):
    with pytest.raises(InputError, match=words):
        board_of_size("6x6", 25.0, kind, **given)


def test_a_dictionary_may_be_named_without_its_prefix():
    assert board_of_size("6x6", 25.0, "charuco", dictionary="4x4_50").dictionary == "DICT_4X4_50"
