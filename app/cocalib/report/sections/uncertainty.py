"""The image: the radar's returns on it, and how far from its drawn place a point may appear at 5, 20 and 60 m."""

from calib_core.results import Calibration
from cocalib.report.markup import Child, Markup, number, tag
from cocalib.report.plots import captioned, drawing, polyline, text
from cocalib.report.subject import Image, ReportSubject
from cocalib.view.contours import ContourMap, contour_maps

_WIDTH = 320.0
_LINES = ("contour a", "contour b", "contour c")


def uncertainty(subject: ReportSubject) -> Markup | None:
    """Return the three maps; None without a camera."""
    calibration = subject.calibration
    if calibration is None:
        return None
    maps = contour_maps(calibration)
    if not any(one.contours for one in maps) and calibration.metrics.n == 0:
        words = tag("p", "This calibration states no uncertainty, so there is no map of it.", class_="note")
        return tag("section", tag("h2", "Uncertainty in the image"), words, id="uncertainty")
    image = subject.recording.image if subject.recording is not None else None
    behind = f" Drawn over {image.words}." if image is not None else ""
    returns = _returns(calibration, image) if image is not None and image.returns_px else None
    grid = "three" if returns is None else "three and-returns"
    return tag(
        "section",
        tag("h2", "Uncertainty in the image"),
        tag(
            "p",
            "Lines of equal 95 % uncertainty of a reprojected point, by its distance from the camera; pose only, without the "
            f"noise of a single radar position.{behind}",
            class_="note",
        ),
        tag("div", returns, *(_map(calibration, one, with_image=image is not None) for one in maps), class_=grid),
        id="uncertainty",
    )


def _returns(calibration: Calibration, image: Image) -> Markup:
    """Return the frame with the returns of its scan as rings: what a reviewer looks at first."""
    scale, height = _WIDTH / calibration.camera.width_px, _height(calibration)
    rings = [
        tag("circle", cx=(u + 0.5) * scale, cy=(v + 0.5) * scale, r=2.6, class_="return") for u, v in image.returns_px
    ]
    words = f"{len(rings)} returns of the nearest scan where this calibration puts them."
    layer = image_layer(calibration, with_image=True)
    return captioned("returns", drawing(words, *layer, *rings, width=_WIDTH, height=float(number(height))), words)


def image_layer(calibration: Calibration, *, with_image: bool) -> list[Child]:
    """Return the outline of the image, 320 wide, with the frame if there is one; its definition is in the page's head."""
    height = _height(calibration)
    frame = tag("use", href="#image", class_="image") if with_image else None
    return [tag("rect", x=0.0, y=0.0, width=_WIDTH, height=height, class_="frame"), frame]


def _height(calibration: Calibration) -> float:
    return _WIDTH * calibration.camera.height_px / calibration.camera.width_px


def _map(calibration: Calibration, found: ContourMap, *, with_image: bool) -> Markup:
    scale, height = _WIDTH / calibration.camera.width_px, _height(calibration)
    levels = list(dict.fromkeys(one.label for one in found.contours))
    lines: list[Child] = []
    for contour in found.contours:
        places = [((u + 0.5) * scale, (v + 0.5) * scale) for u, v in contour.points_px]
        lines += [polyline(places, class_="halo"), polyline(places, class_=_LINES[levels.index(contour.label) % 3])]
    named: set[str] = set()
    for contour in found.contours:
        if contour.label not in named and len(contour.points_px) > 4:
            named.add(contour.label)
            u, v = contour.points_px[len(contour.points_px) // 2]
            x = min(max((u + 0.5) * scale, 18.0), _WIDTH - 18.0)
            y = min(max((v + 0.5) * scale + 3.0, 11.0), height - 4.0)
            lines.append(text(x, y, contour.label, class_="middle label"))
    drawn = drawing(
        f"Map of the uncertainty at {found.label}. {found.words}",
        *image_layer(calibration, with_image=with_image),
        *lines,
        width=_WIDTH,
        height=float(number(height)),
    )
    return captioned(f"at {found.label}", drawn, found.words)
