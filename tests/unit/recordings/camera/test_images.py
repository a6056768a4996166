"""Images: files are passed through, pixels converted, and the rest refused with a clear error."""

import cv2
import numpy as np
import pytest

from calib_core.errors import MessageError, RecordingError
from calib_core.measurements import NS_PER_S
from calib_core.recordings import RecordingOptions, inspect_recording, open_recording
from calib_core.recordings.camera.jpeg import repaired_jpeg

START_NS = 1_700_000_000 * NS_PER_S
EXIF_TURNED = b"\xff\xe1\x00\x22Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0"


def opened(write, ros, *messages, **options):
    rows = [("/camera/image", START_NS + i * 10**8, message) for i, message in enumerate(messages)]
    return open_recording(write(ros, rows), RecordingOptions(**options), require=("image",))


def image(height: int = 24, width: int = 32) -> np.ndarray:
    """Return an image of smooth colours, blue first."""
    v, u = np.mgrid[:height, :width]
    return np.stack([u * 255 // width, v * 255 // height, 255 - u * 127 // width], axis=2).astype(np.uint8)


def test_a_jpeg_is_passed_through_byte_for_byte_whatever_the_format_says(ros, write, jpeg):
    with opened(write, ros, ros.compressed(START_NS, jpeg, "png; nonsense")) as recording:
        frame = recording.image_bytes(0)
        assert (frame.data, frame.format) == (jpeg, "jpeg")
        expected = cv2.imdecode(np.frombuffer(jpeg, dtype=np.uint8), cv2.IMREAD_COLOR)
        np.testing.assert_array_equal(recording.image(0), expected)


def test_a_png_is_passed_through_byte_for_byte(ros, write):
    data = cv2.imencode(".png", image())[1].tobytes()
    with opened(write, ros, ros.compressed(START_NS, data, "jpeg")) as recording:
        frame = recording.image_bytes(0)
        assert (frame.data, frame.format, frame.width_px, frame.height_px) == (data, "png", 32, 24)
        np.testing.assert_array_equal(recording.image(0), image())


def test_an_orientation_in_the_exif_block_does_not_rotate_the_image(ros, write, jpeg):
    turned = jpeg[:2] + EXIF_TURNED + jpeg[2:]
    assert cv2.imdecode(np.frombuffer(turned, dtype=np.uint8), cv2.IMREAD_COLOR).shape == (64, 48, 3)
    with opened(write, ros, ros.compressed(START_NS, turned)) as recording:
        assert recording.image_bytes(0).data == jpeg
        assert recording.image(0).shape == (48, 64, 3)


def test_a_missing_end_marker_is_added(ros, write, jpeg):
    assert jpeg.endswith(b"\xff\xd9")
    with opened(write, ros, ros.compressed(START_NS, jpeg[:-2])) as recording:
        assert recording.image_bytes(0).data == jpeg
    assert repaired_jpeg(jpeg + bytes(8))[0] == jpeg + bytes(8)


@pytest.mark.parametrize("cut", [0, 2, 3, 30])
def test_a_jpeg_cut_before_its_image_is_refused(jpeg, cut):
    with pytest.raises(MessageError):
        repaired_jpeg(jpeg[:cut])


@pytest.mark.parametrize(
    ("encoding", "pixels"),
    [
        ("bgr8", image()),
        ("rgb8", cv2.cvtColor(image(), cv2.COLOR_BGR2RGB)),
        ("bgra8", cv2.cvtColor(image(), cv2.COLOR_BGR2BGRA)),
        ("rgba8", cv2.cvtColor(image(), cv2.COLOR_BGR2RGBA)),
        ("8UC3", image()),
    ],
)
def test_raw_colour_images_keep_their_pixels_and_padded_rows_are_cut(ros, write, encoding, pixels):
    height, width, channels = pixels.shape
    rows = np.pad(pixels.reshape(height, width * channels), ((0, 0), (0, 5)), constant_values=77)
    message = ros.image(START_NS, rows, encoding, width=width)
    with opened(write, ros, message) as recording:
        np.testing.assert_array_equal(recording.image(0), image())
        frame = recording.image_bytes(0)
        assert (frame.format, frame.width_px, frame.height_px) == ("jpeg", width, height)
        back = cv2.imdecode(np.frombuffer(frame.data, dtype=np.uint8), cv2.IMREAD_COLOR)
        assert np.abs(back.astype(int) - image()).mean() < 2.0


def test_grey_images_become_grey_images(ros, write):
    grey = image()[:, :, 0]
    with opened(write, ros, ros.image(START_NS, grey, "mono8")) as recording:
        np.testing.assert_array_equal(recording.image(0), np.repeat(grey[:, :, None], 3, axis=2))


@pytest.mark.parametrize(
    ("bits", "levels", "shown"), [(8, (200, 120, 40), (200, 120, 40)), (16, (4095, 2048, 0), (255, 128, 0))]
)
@pytest.mark.parametrize("pattern", ["rggb", "bggr", "gbrg", "grbg"])
def test_bayer_patterns_give_the_right_colours(ros1, write, pattern, bits, levels, shown):
    colour = dict(zip("rgb", levels, strict=True))
    tile = np.array([colour[letter] for letter in pattern], dtype=f"<u{bits // 8}").reshape(2, 2)
    rows = np.tile(tile, (12, 16)).view(np.uint8)
    with opened(write, ros1, ros1.image(START_NS, rows, f"bayer_{pattern}{bits}", width=32)) as recording:
        np.testing.assert_array_equal(recording.image(0)[4:-4, 4:-4].reshape(-1, 3), [shown[::-1]] * (16 * 24))


@pytest.mark.parametrize(("encoding", "order"), [("yuv422", "uyvy"), ("yuv422_yuy2", "yuyv")])
def test_yuv_images_give_the_right_colours(ros1, write, encoding, order):
    value = {"u": 90, "v": 160, "y": 130}
    row = np.array([value[letter] for letter in order] * 8, dtype=np.uint8)
    message = ros1.image(START_NS, np.tile(row, (8, 1)), encoding, width=16)
    with opened(write, ros1, message) as recording:
        blue, green, red = recording.image(0)[4, 4].astype(int)
    y, u, v = 1.164 * (130 - 16), 90 - 128, 160 - 128
    expected = np.array([y + 2.018 * u, y - 0.391 * u - 0.813 * v, y + 1.596 * v])
    np.testing.assert_allclose([blue, green, red], expected, atol=2)


@pytest.mark.parametrize(("encoding", "order"), [("nv12", (90, 160)), ("nv21", (160, 90))])
def test_images_in_two_planes_give_the_right_colours(ros1, write, encoding, order):
    rows = np.vstack([np.full((8, 16), 130), np.tile(order, (4, 8))]).astype(np.uint8)
    message = ros1.image(START_NS, rows, encoding, width=16, height=8)
    with opened(write, ros1, message) as recording:
        image = recording.image(0)
    y, u, v = 1.164 * (130 - 16), 90 - 128, 160 - 128
    assert image.shape == (8, 16, 3)
    np.testing.assert_allclose(image[4, 4], [y + 2.018 * u, y - 0.391 * u - 0.813 * v, y + 1.596 * v], atol=2)


@pytest.mark.parametrize("big", [False, True])
@pytest.mark.parametrize("bits", [10, 12, 16])
def test_grey_of_16_bits_is_stretched_whatever_the_camera_fills(ros1, write, big, bits):
    ramp = np.linspace(0, 2**bits - 1, 64 * 64).astype(np.uint16).reshape(64, 64)
    rows = ramp.astype(">u2" if big else "<u2").view(np.uint8)
    padded = np.pad(rows, ((0, 0), (0, 6)))
    message = ros1.image(START_NS, padded, "mono16", width=64, is_bigendian=int(big))
    with opened(write, ros1, message) as recording:
        found = recording.image(0)
    assert found.shape == (64, 64, 3)
    np.testing.assert_allclose(found[:, :, 0], np.linspace(0, 255, 64 * 64).reshape(64, 64), atol=1.6)
    np.testing.assert_array_equal(found[:, :, 0], found[:, :, 2])


@pytest.mark.parametrize(
    ("encoding", "values"),
    [
        ("rgb16", (200, 120, 40)),
        ("bgr16", (40, 120, 200)),
        ("rgba16", (200, 120, 40, 7)),
        ("bgra16", (40, 120, 200, 7)),
    ],
)
def test_colour_of_16_bits_keeps_its_order_of_channels(ros1, write, encoding, values):
    pixels16 = np.zeros((16, 16, len(values)), dtype="<u2")
    pixels16[:8] = np.array(values) * 256
    message = ros1.image(START_NS, pixels16.reshape(16, -1).view(np.uint8), encoding, width=16)
    with opened(write, ros1, message) as recording:
        blue, green, red = recording.image(0)[2, 2].astype(int)
    assert blue < green < red == 255


def test_a_png_of_16_bit_grey_that_says_mono16_is_stretched(ros, write):
    ramp = np.linspace(0, 4095, 32 * 32).astype(np.uint16).reshape(32, 32)
    data = cv2.imencode(".png", ramp)[1].tobytes()
    with opened(write, ros, ros.compressed(START_NS, data, "mono16; png compressed ")) as recording:
        assert recording.image_bytes(0).format == "png"
        np.testing.assert_allclose(recording.image(0)[:, :, 1], ramp / 4095 * 255, atol=1.6)


@pytest.mark.parametrize(
    ("encoding", "words"),
    [
        (
            "16UC1",
            "the encoding '16UC1' is not supported; a depth image has no defined brightness scale, convert it to mono8",
        ),
        ("32FC1", "a depth image has no defined brightness scale"),
        ("bayer_rggb12", "'bayer_rggb12' is not supported; jpeg, png, bgr8"),
        ("nonsense", "'nonsense' is not supported; jpeg, png, bgr8"),
    ],
)
def test_unsupported_raw_encodings_are_refused_with_a_clear_error(ros, write, encoding, words):
    message = ros.image(START_NS, np.zeros((4, 8), dtype=np.uint8), encoding, width=4)
    with pytest.raises(RecordingError, match="no readable camera image topic") as caught:
        opened(write, ros, message)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("data", "form", "words"),
    [
        (b"qoif" + bytes(40), "rgb8; qoi", "the encoding 'qoi' is not supported; record in jpeg or png"),
        (bytes(12) + b"\x89PNG" + bytes(40), "16UC1; compressedDepth", "is a depth image, not an image"),
        (b"RIFF1234WEBP" + bytes(40), "webp", "the encoding 'webp' is not supported"),
        (b"", "jpeg", "declared as 'jpeg', but the data is neither JPEG nor PNG"),
        (b"\xff\xd8\xff\xe0", "jpeg", "the JPEG ends before its image data"),
        (cv2.imencode(".png", np.zeros((4, 4), np.uint16))[1].tobytes(), "16UC1; png compressed ", "16-bit grey"),
    ],
)
def test_unreadable_compressed_images_are_refused_with_a_clear_error(ros, write, data, form, words):
    path = write(ros, [("/camera/image", START_NS, ros.compressed(START_NS, data, form))])
    with pytest.raises(MessageError, match="topic /camera/image") as caught:
        open_recording(path, RecordingOptions(image_topic="/camera/image"), require=())
    assert words in str(caught.value)
    with inspect_recording(path) as recording:
        assert recording.image_topic is None
        assert words in str(recording.topics[0].problem)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"height": 100_000, "width": 100_000, "step": 100_000}, "100000 x 100000 pixels is refused"),
        ({"height": 0}, "is refused"),
        ({"step": 3}, "rows of 3 bytes"),
        ({"height": 25}, "has 768 bytes of data, but 800 are required"),
        ({"step": 2**31}, "the message is damaged"),
    ],
)
def test_images_with_inconsistent_sizes_are_refused(ros, write, changes, words):
    message = ros.image(START_NS, image()[:, :, 0], "mono8", **changes)
    with pytest.raises(RecordingError) as caught:
        opened(write, ros, message)
    assert words in str(caught.value)


def test_one_damaged_frame_does_not_affect_the_others(ros, write, jpeg):
    broken = jpeg[:60]
    with opened(
        write, ros, *(ros.compressed(START_NS + i * 10**8, d) for i, d in enumerate([jpeg, broken, jpeg]))
    ) as recording:
        assert recording.image_times.tolist() == [START_NS, START_NS + 2 * 10**8]
        assert [recording.image_bytes(index).data for index in range(2)] == [jpeg, jpeg]
        (warning,) = recording.warnings
        assert warning.code == "unreadable-pictures"
        assert warning.facts["message"].startswith("1 of 3 images ")
        assert "(2023-11-14 22:13:20.100" in warning.facts["message"]


@pytest.mark.parametrize("count", [6, 200])
def test_images_of_another_size_are_skipped_and_told_with_their_times(count, ros, write, jpeg):
    large = cv2.imencode(".jpg", np.zeros((96, 128, 3), dtype=np.uint8))[1].tobytes()
    odd = range(2, count, 5)
    messages = [ros.compressed(START_NS + i * 10**8, large if i in odd else jpeg) for i in range(count)]
    with opened(write, ros, *messages) as recording:
        assert len(recording.image_times) == count - len(odd)
        assert START_NS + 2 * 10**8 not in recording.image_times
        assert {recording.image_bytes(index).width_px for index in range(len(recording.image_times))} == {64}
        (warning,) = recording.warnings
    assert warning.code == "picture-sizes"
    assert f"{len(odd)} have 128 x" in warning.facts["message"]


def test_raw_images_of_another_size_are_skipped(ros, write):
    small, large = np.zeros((8, 12), dtype=np.uint8), np.zeros((16, 24), dtype=np.uint8)
    messages = [ros.image(START_NS + i * 10**8, large if i == 2 else small, "mono8") for i in range(5)]
    with opened(write, ros, *messages) as recording:
        assert len(recording.image_times) == 4
        assert [warning.code for warning in recording.warnings] == ["picture-sizes"]


def test_a_single_image_of_another_size_in_a_long_recording_is_refused_when_it_is_read(ros1, write, jpeg):
    large = cv2.imencode(".jpg", np.zeros((96, 128, 3), dtype=np.uint8))[1].tobytes()
    messages = [ros1.compressed(START_NS + i * 10**8, large if i == 1 else jpeg) for i in range(300)]
    with opened(write, ros1, *messages) as recording:
        with pytest.raises(
            MessageError, match=r"this frame has 128 x 96 pixels, the others have 64 x 48; choose another"
        ):
            recording.image_bytes(1)
        with pytest.raises(MessageError, match="128 x 96"):
            recording.image(1)


def test_frames_with_the_same_stamp_are_shown_once_with_a_warning(ros, write, jpeg):
    messages = [ros.compressed(START_NS + (i // 2) * 10**8, jpeg) for i in range(6)]
    with opened(write, ros, *messages) as recording:
        assert recording.image_times.tolist() == [START_NS, START_NS + 10**8, START_NS + 2 * 10**8]
        assert [warning.code for warning in recording.warnings] == ["repeated-stamps"]
        assert "3 images of /camera/image" in recording.warnings[0].facts["message"]


def test_the_camera_with_intrinsics_and_colour_is_chosen(ros, write, jpeg):
    grey = np.zeros((8, 8), dtype=np.uint8)
    rows = []
    for i in range(4):
        at = START_NS + i * 10**8
        rows += [
            ("/a/depth/image", at, ros.image(at, grey, "mono8")),
            ("/a/depth/image", at + 1, ros.image(at + 1, grey, "mono8")),
        ]
        rows += [("/b/image_raw", at, ros.image(at, grey, "mono8")), ("/b/camera_info", at, ros.camera_info(at))]
        rows += [("/c/image_raw", at, ros.image(at, grey, "mono8"))]
    with open_recording(write(ros, rows), require=("image",)) as recording:
        assert (recording.image_topic, recording.camera_info_topic) == ("/b/image_raw", "/b/camera_info")


# CameraInfo becomes the camera of the published pixels.

K = np.array([[500.0, 0, 319.5], [0, 510.0, 239.5], [0, 0, 1]])


def camera_of(write, ros, *infos, size=(640, 480), topic="/camera/image"):
    grey = np.zeros((size[1], size[0]), dtype=np.uint8)
    rows = [(topic, START_NS, ros.image(START_NS, grey, "mono8"))]
    rows += [("/camera/camera_info", START_NS + i, info) for i, info in enumerate(infos)]
    with open_recording(write(ros, rows), require=("image",)) as recording:
        return recording.camera(), [warning.code for warning in recording.warnings], recording.warnings


@pytest.mark.parametrize(
    ("model", "distortion", "expected", "coefficients"),
    [
        ("plumb_bob", [-0.1, 0.02, 0.001, -0.002, 0.003], "plumb_bob", 5),
        ("plumb_bob", [0.0] * 5, "pinhole", 0),
        ("rational_polynomial", [0.1, 0.2, 0, 0, 0.3, 0.4, 0.5, 0.6, 0, 0, 0, 0], "rational_polynomial", 8),
        ("equidistant", [0.1, 0.2, 0.3, 0.4], "equidistant", 4),
        ("Plumb Bob", [-0.1, 0.02, 0.001, -0.002, 0.003], "plumb_bob", 5),
        ("plumb'bob", [-0.1, 0.02, 0.001, -0.002, 0.003], "plumb_bob", 5),
        ("Brown Conrady", [-0.1, 0.02, 0.001, -0.002, 0.003], "plumb_bob", 5),
        ("Plumb Bob", [], "pinhole", 0),
        ("pinhole", [], "pinhole", 0),
        ("none", [0.0] * 5, "pinhole", 0),
        ("rectified", [], "pinhole", 0),
    ],
)
def test_lens_models_are_read(ros, write, model, distortion, expected, coefficients):
    info = ros.camera_info(distortion_model=model, D=np.array(distortion, dtype=np.float64))
    camera, codes, _ = camera_of(write, ros, info)
    assert (camera.model, camera.distortion.tolist(), codes) == (expected, distortion[:coefficients], [])
    assert (camera.width_px, camera.height_px) == (640, 480)
    np.testing.assert_array_equal(camera.matrix_px, K)


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"K": np.zeros(9)}, "camera-uncalibrated"),
        ({"K": np.full(9, np.nan)}, "camera-uncalibrated"),
        ({"distortion_model": "omnidirectional"}, "camera-model"),
        ({"distortion_model": "none", "D": np.ones(5)}, "camera-model"),
        ({"D": np.ones(12)}, "camera-model"),
        ({"D": np.array([np.inf, 0, 0, 0, 0])}, "camera-model"),
        ({"distortion_model": "equidistant", "D": np.ones(2)}, "camera-model"),
        ({"width": 0, "height": 0}, "camera-size"),
        ({"width": 640, "height": 640}, "camera-size"),
    ],
)
def test_unusable_intrinsics_are_none_with_a_warning(ros, write, changes, code):
    camera, codes, warnings = camera_of(write, ros, ros.camera_info(**changes))
    assert camera is None
    assert codes == [code]
    assert "/camera/camera_info" in warnings[0].facts["message"]
    assert "--camera FILE" in warnings[0].facts["hint"]


@pytest.mark.parametrize(
    ("info", "published", "focal_px", "centre_px", "codes"),
    [
        ({"region": (100, 50, 320, 200)}, {"size": (320, 200)}, (500, 510), (219.5, 189.5), []),
        # the middle of the sensor is the middle of the binned image: (640 - 1) / 2 becomes (320 - 1) / 2
        ({"binning_x": 2, "binning_y": 2}, {"size": (320, 240)}, (250, 255), (159.5, 119.5), []),
        ({}, {"size": (320, 240)}, (250, 255), (159.5, 119.5), ["camera-scaled"]),
        ({}, {"topic": "/camera/image_rect_color"}, (450, 459), (319.5 * 0.9, 239.5 * 0.9), []),
    ],
    ids=["a region", "binned", "resized", "rectified"],
)
def test_the_camera_is_that_of_the_published_pixels(ros, write, info, published, focal_px, centre_px, codes):
    camera, found, _ = camera_of(write, ros, ros.camera_info(**info), **published)
    np.testing.assert_allclose(camera.matrix_px[[0, 1], [0, 1]], focal_px)
    np.testing.assert_allclose(camera.matrix_px[:2, 2], centre_px)
    assert ((camera.width_px, camera.height_px), found) == (published.get("size", (640, 480)), codes)
    assert camera.model == ("pinhole" if "topic" in published else "plumb_bob")


def test_intrinsics_that_change_during_the_recording_give_a_warning(ros, write):
    other = ros.camera_info(K=2 * np.array([500.0, 0, 319.5, 0, 510.0, 239.5, 0, 0, 0.5]))
    camera, codes, _ = camera_of(write, ros, ros.camera_info(), other)
    assert camera.matrix_px[0, 0] == 500
    assert codes == ["camera-changes"]
