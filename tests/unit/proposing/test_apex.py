"""The apex of a reflector in images with a known apex, and the refusal where there is none."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from calib_core.proposing.apex import Apex, NoApex, find_apex
from tests.unit.proposing.trihedral import Appearance, background, draw_look, noisy_image

_SIDE = (200, 200)


def _look(width_px: float = 60.0) -> tuple[Appearance, np.ndarray, np.random.Generator]:
    """A well-lit reflector in front of a quiet background."""
    rng = np.random.default_rng(5)
    look = replace(
        draw_look(rng, size_px=_SIDE, width_px=width_px), blur_px=0.6, noise_grey=1.0, jpeg_quality=90, gain=1.0
    )
    return look, np.full((200, 200), 0.25), rng


def _found(image: np.ndarray, near_px: np.ndarray, **options: float) -> Apex:
    answer = find_apex(image, near_px, **options)
    assert isinstance(answer, Apex), answer
    return answer


def test_the_apex_is_found_below_a_pixel_at_every_width():
    for width_px in (16.0, 30.0, 60.0, 120.0, 180.0):
        look, behind, rng = _look(width_px)
        apex = _found(noisy_image(look, behind, rng), look.apex_px + np.array([5.0, -4.0]))
        assert np.hypot(*(apex.pixel_px - look.apex_px)) < 0.6
        assert 0.05 < apex.sigma_px < 0.6


@pytest.mark.slow
def test_errors_are_as_large_as_their_covariance_says():
    squares = []
    for number in range(60):
        rng = np.random.default_rng([31, number])
        look = draw_look(rng, size_px=_SIDE, width_px=float(rng.uniform(25.0, 50.0)))
        answer = find_apex(noisy_image(look, background(rng, _SIDE), rng), look.apex_px + rng.uniform(-5.0, 5.0, 2))
        if isinstance(answer, Apex):
            error = answer.pixel_px - look.apex_px
            squares.append(float(error @ np.linalg.solve(answer.covariance_px2, error)))
    assert len(squares) > 45
    inside = [float(np.mean(np.array(squares) < limit)) for limit in (1.386, 4.605)]
    assert 0.35 < inside[0] < 0.80
    assert 0.80 < inside[1] < 0.99


def test_the_given_pixel_does_not_pull_the_apex():
    look, behind, rng = _look()
    image = noisy_image(look, behind, rng)
    first = _found(image, look.apex_px)
    for number in range(12):
        turn = 2.0 * np.pi * number / 12.0
        near_px = look.apex_px + 12.0 * np.array([np.cos(turn), np.sin(turn)])
        answer = find_apex(image, near_px)
        assert isinstance(answer, NoApex) or np.hypot(*(answer.pixel_px - first.pixel_px)) < 0.05


def test_an_apex_beyond_reach_is_not_taken():
    look, behind, rng = _look()
    image = noisy_image(look, behind, rng)
    assert isinstance(find_apex(image, look.apex_px + np.array([18.0, 0.0])), NoApex)
    assert isinstance(find_apex(image, look.apex_px + np.array([18.0, 0.0]), reach_px=25.0), Apex)


def test_turning_flipping_and_moving_the_image_turns_flips_and_moves_the_apex():
    look, behind, rng = _look()
    image = noisy_image(look, behind, rng)
    last = image.shape[1] - 1.0
    apex = _found(image, look.apex_px + 3.0).pixel_px
    near = look.apex_px + 3.0
    turned = _found(np.rot90(image).copy(), np.array([near[1], last - near[0]])).pixel_px
    assert turned == pytest.approx([apex[1], last - apex[0]], abs=0.08)
    flipped = _found(image[:, ::-1].copy(), np.array([last - near[0], near[1]])).pixel_px
    assert flipped == pytest.approx([last - apex[0], apex[1]], abs=0.08)
    moved = _found(np.pad(image, ((13, 0), (6, 0)), mode="edge"), near + np.array([6.0, 13.0])).pixel_px
    assert moved == pytest.approx(apex + np.array([6.0, 13.0]), abs=0.08)


def test_exposure_and_colour_do_not_move_the_apex():
    look, behind, rng = _look()
    quiet = replace(look, noise_grey=0.0, jpeg_quality=None)
    apex = _found(noisy_image(quiet, behind, rng), look.apex_px + 3.0).pixel_px
    darker = _found(noisy_image(replace(quiet, gain=0.5), behind, rng), look.apex_px + 3.0).pixel_px
    assert darker == pytest.approx(apex, abs=0.1)
    coloured = cv2.cvtColor(noisy_image(quiet, behind, rng), cv2.COLOR_GRAY2BGR)
    assert _found(coloured, look.apex_px + 3.0).pixel_px == pytest.approx(apex, abs=1e-6)


def test_a_reflector_at_the_rim_of_the_image_is_found_or_refused():
    look, behind, rng = _look()
    image = noisy_image(look, behind, rng)
    column, row = (int(v) for v in look.apex_px)
    corner_px = np.array([column - 4, row - 4])
    answer = find_apex(image[row - 4 :, column - 4 :], look.apex_px - corner_px)
    assert isinstance(answer, NoApex) or np.hypot(*(answer.pixel_px + corner_px - look.apex_px)) < 1.0
    assert isinstance(find_apex(image, np.array([-40.0, 500.0])), NoApex)


def _edge(image: np.ndarray) -> None:
    image[:, 100:] = 200


def _line(image: np.ndarray) -> None:
    cv2.line(image, (40, 70), (160, 130), 220, 3, cv2.LINE_AA)


def _box_corner(image: np.ndarray) -> None:
    image[100:, 100:] = 210


def _t_junction(image: np.ndarray) -> None:
    image[100:, :100], image[100:, 100:] = 60, 210


def _checkerboard(image: np.ndarray) -> None:
    image[:100, :100] = image[100:, 100:] = 220


@pytest.mark.parametrize("draw", [_edge, _line, _box_corner, _t_junction, _checkerboard])
def test_edges_lines_and_other_corners_are_refused(draw):
    for turn in (0.0, 17.0, 40.0):
        image = np.full((200, 200), 120, np.uint8)
        draw(image)
        turned = cv2.warpAffine(
            image, cv2.getRotationMatrix2D((99.5, 99.5), turn, 1.0), (200, 200), borderMode=cv2.BORDER_REPLICATE
        )
        noise = np.random.default_rng(int(turn)).normal(0.0, 3.0, turned.shape)
        noisy = np.clip(cv2.GaussianBlur(turned, (0, 0), 0.8) + noise, 0.0, 255.0).astype(np.uint8)
        answer = find_apex(noisy, np.array([101.0, 98.0]))
        assert isinstance(answer, NoApex)
        assert "within 15 px" in answer.reason


@pytest.mark.slow
def test_backgrounds_and_the_outer_tips_of_a_reflector_are_refused():
    false = 0
    for number in range(30):
        rng = np.random.default_rng([77, number])
        look = replace(draw_look(rng, size_px=_SIDE, width_px=1.0), apex_px=np.array([4.0, 4.0]))
        false += isinstance(find_apex(noisy_image(look, background(rng, _SIDE), rng), np.array([100.0, 100.0])), Apex)
    assert false <= 2
    look, behind, rng = _look(120.0)
    tips = [look.apex_px + 62.0 * np.array([np.cos(t), np.sin(t)]) for t in np.linspace(0.0, 6.0, 12)]
    assert not any(isinstance(find_apex(noisy_image(look, behind, rng), tip), Apex) for tip in tips)


def test_two_reflectors_within_reach_are_refused_by_name():
    look, behind, rng = _look(17.0)
    one = replace(look, apex_px=np.array([92.0, 100.0]), noise_grey=0.0, jpeg_quality=None)
    image = noisy_image(one, behind, rng)
    image[:, 101:] = image[:, 83:182]
    answer = find_apex(image, np.array([101.0, 100.0]))
    assert isinstance(answer, NoApex)
    assert "18 px apart" in answer.reason


def test_a_corner_larger_than_the_reflector_is_refused():
    look, behind, rng = _look(180.0)
    image = noisy_image(look, behind, rng)
    answer = find_apex(image, look.apex_px, size_px=15.0)
    assert isinstance(answer, NoApex)
    assert "reflector of 15 px" in answer.reason
    assert isinstance(find_apex(image, look.apex_px, size_px=180.0), Apex)
