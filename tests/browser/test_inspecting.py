"""What the page says about the recording itself: how each sensor is read, by which clock and why, and its warnings."""

from collections.abc import Callable
from pathlib import Path

import pytest

from calib_core.recordings import RecordingOptions, open_recording
from tests.browser.driving import Driver
from tests.serving import OWN_PORT, serving
from tests.vendor_recording import vendor_sample

pytestmark = [pytest.mark.browser, pytest.mark.no_3d_view]


def test_clocks_axes_and_warnings_of_the_recording_are_on_the_page(
    open_page: Callable[..., Driver], project_root: Path, tmp_path: Path
) -> None:
    folder = project_root / "sample_data" / "rooftop"
    cut = tmp_path / "radar.bag"
    whole = (folder / "radar.bag").read_bytes()
    cut.write_bytes(whole[: len(whole) * 2 // 3])
    options = RecordingOptions(clock="receive", radar_axes="forward,left,up")
    with open_recording([cut, folder / "camera.bag"], options) as recording:
        camera = recording.camera()
        with serving(recording, tmp_path / "s", camera=camera, name="cut", port=OWN_PORT, token="test") as (running, _):
            page = open_page(running.url)
            assert page.text("#recording-topics") == "receive time: radar, camera"
            page.page.click("#choose-recording")
            page.page.click("#opening-dialog .reading summary")
            page.until("document.body.innerText.includes('because --clock receive was given')")
            page.until("document.body.innerText.includes('axes as given: x forward, y left, z up')")
            page.until("document.body.innerText.includes('after its stamp')")
            box = page.text('#opening-dialog [data-code="not-closed"]')
            assert "messages were recovered" in box


@pytest.mark.slow
def test_assumptions_are_listed_until_the_user_confirms_them(
    open_page: Callable[..., Driver], project_root: Path, tmp_path: Path
) -> None:
    with (
        open_recording(vendor_sample(project_root / "sample_data" / "rooftop", tmp_path)) as recording,
        serving(recording, tmp_path / "s", camera=recording.camera(), port=OWN_PORT, token="test") as (
            running,
            workspace,
        ),
    ):
        page = open_page(running.url)
        assert page.page.get_attribute("#recording-notes", "class") == "asks"
        page.page.click("#choose-recording")
        box = page.text('#opening-dialog [data-code="assumed"]')
        assert "2 assumptions" in box
        assert "f_Azimuth is taken" in box
        assert "--map azimuth=f_Azimuth:rad" in box
        page.page.click("#opening-dialog .reading summary")
        page.until("document.body.innerText.includes('azimuth from f_Azimuth [rad], to the left')")
        page.page.locator("#confirm-assumptions").click()
        page.until("document.querySelectorAll('#opening-dialog [data-code=assumed]').length === 0")
        assert len(workspace.session.confirmed) == 2


@pytest.mark.slow
def test_a_recording_without_problems_shows_no_warning(page: Driver) -> None:
    assert "receive time" not in page.text("#recording-topics")
    assert page.page.locator("#warnings *").count() == 0
    assert page.text("#recording-notes") == ""
    page.page.click("#choose-recording")
    page.page.click("#opening-dialog .reading summary")
    page.until("document.body.innerText.includes('because the stamps are sound')")
