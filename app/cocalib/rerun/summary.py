"""The text beside the views: what is shown, the figures, and what the colours mean."""

from collections.abc import Iterator

from cocalib.recorded_view import RecordedView


def summary_text(view: RecordedView) -> str:
    """Return the summary as plain text: as Markdown, a name in a recording could make the viewer fetch a picture."""
    return "\n".join(_lines(view)) + "\n"


def _lines(view: RecordedView) -> Iterator[str]:
    recording = view.recording
    yield f"recording: {recording.name}"
    yield f"radar: {recording.radar_topic}, camera: {recording.image_topic}"
    yield ""
    yield str(view.calibration)
    yield ""
    yield from _figures(view)
    what = "range" if view.colours.quantity == "range" else "radial speed"
    low, high = view.colours.ends
    yield f"returns: coloured by {what}, {low} to {high}"
    if view.against is not None:
        yield "pink: the other calibration"
    if view.pairs:
        yield "clicks: blue for residuals near 0 px, red from 30 px; outlines contain 95 % of the clicks of good pairs"
    if view.calibration.camera.is_distorted:
        yield (
            "lens: returns are projected through the calibration's own lens; the frustum in 3D is of the camera matrix alone, "
            "because Rerun has no lens distortion"
        )
    for warning in view.calibration.warnings:
        yield f"warning {warning.code}: {warning.message}"


def _figures(view: RecordedView) -> Iterator[str]:
    evaluation = view.evaluation
    if evaluation is None:
        return
    if evaluation.residuals is not None:
        figures = evaluation.residuals
        metrics = figures.metrics
        yield (
            f"on this recording: AED {metrics.aed_px:.2f} px, CDSD {metrics.cdsd_px:.2f} px, median {figures.median_px:.2f} px, "
            f"{metrics.n} clicks"
        )
    boxes = evaluation.boxes
    if boxes is not None and boxes.acc is not None:
        frames = sum(frame.returns > 0 for frame in boxes.frames)
        yield f"Acc {100 * boxes.acc:.1f} % over {frames} frames ({boxes.source}); it is nearly blind to roll"
