"""How the Rerun viewer opens: the picture with its overlays, the figures over time, the radar in 3D, the summary."""

import rerun as rr
import rerun.blueprint as rrb

from cocalib.recorded_view import RecordedView
from cocalib.rerun.entities import ACC, AED, METRICS, PICTURE, RADAR, RESIDUALS, RETURNS_SEEN, SUMMARY, TIMELINE

_BACKGROUND = (13, 16, 20)


def layout(view: RecordedView) -> rrb.Blueprint:
    """Return the blueprint for what there is to show."""
    series = [_series("Returns in the picture", RETURNS_SEEN)]
    if view.pairs:
        series.insert(0, _series("Residuals [px]", RESIDUALS, AED))
    if view.acc_by_frame():
        series.insert(0, _series("Acc [%]", ACC))
    picture = rrb.Spatial2DView(origin=PICTURE, name="Picture")
    far_m = view.colours.high if view.colours.quantity == "range" else 30.0
    eye = rrb.EyeControls3D(
        position=(-0.35 * far_m, 0.0, 0.35 * far_m), look_target=(0.3 * far_m, 0.0, 0.0), eye_up=(0, 0, 1)
    )
    space = rrb.Spatial3DView(origin=RADAR, name="Radar frame", background=_BACKGROUND, eye_controls=eye)
    summary = rrb.TextDocumentView(origin=SUMMARY, name="Summary")
    left = rrb.Vertical(picture, *series, row_shares=[3.0, *([1.0] * len(series))])
    right = rrb.Vertical(space, summary, row_shares=[3.0, 1.6])
    return rrb.Blueprint(
        rrb.Horizontal(left, right, column_shares=[1.2, 1.0]),
        rrb.TimePanel(timeline=TIMELINE, state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
    )


def _series(name: str, *contents: str) -> rrb.TimeSeriesView:
    """Return a plot over the whole recording."""
    always = rr.TimeRange(start=rr.TimeRangeBoundary.infinite(), end=rr.TimeRangeBoundary.infinite())
    return rrb.TimeSeriesView(
        origin=METRICS,
        contents=list(contents),
        name=name,
        axis_x=rrb.TimeAxis(view_range=always),
        plot_legend=rrb.Corner2D.LeftTop,
    )
