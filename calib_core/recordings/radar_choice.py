"""Choose the radar among the sensors of a recording, by figures, and say why."""

from collections.abc import Sequence
from dataclasses import dataclass

from calib_core.recordings.radar.scan_stream import RadarStream
from calib_core.recordings.radar.several_topics.sensors import Examined, Figures, RadarSensor, sensors_of
from calib_core.recordings.selection import Inventory, Selection, holds_objects, radar_rank, unknown_radar
from calib_core.results import DataWarning

_PLENTY = 0.25  # of the most static returns ahead: with fewer, a radar looks elsewhere
_COMPARABLE = 0.5  # with more than this of them, another radar could be meant
_NOTHING_STATIC = 1.0  # returns a scan: the recording was made on the move


@dataclass(frozen=True, slots=True)
class RadarChoice:
    """The radar in use, and the others.

    Attributes:
        sensors: all that were compared, the chosen one first; empty if there is one topic only.
        reason: which one is used and why, with figures, as a sentence without its final period; "" if there is no other.
        warnings: about a choice that is not clear, and about topics that do not belong together.
    """

    sensors: tuple[RadarSensor, ...] = ()
    reason: str = ""
    warnings: tuple[DataWarning, ...] = ()


def choose_radar(
    streams: Sequence[RadarStream], frames: Sequence[str], inventory: Inventory, selection: Selection
) -> RadarChoice:
    """Group the radar topics into sensors and choose one.

    Args:
        streams: of the selection's radar topics, the preferred one first.
        frames: their frame_ids.
        inventory: all topics.
        selection: what the user asked for.

    Raises:
        RecordingError: there is no radar of the name the user gave.
    """
    if not streams:
        return RadarChoice()
    examined = [
        Examined.of(stream, frame, returns=_has_returns(stream, inventory))
        for stream, frame in zip(streams, frames, strict=True)
    ]
    if selection.radar_named:
        (sensor,) = sensors_of(examined, together=True)
        return RadarChoice((sensor,), f"{_described(sensor)}, as requested", tuple(_about_frames(examined)))
    sensors = sensors_of(examined)
    if selection.sensor is not None:
        wanted = [sensor for sensor in sensors if sensor.name == selection.sensor]
        if not wanted:
            raise unknown_radar(inventory, selection.sensor, [sensor.name for sensor in sensors])
        others = tuple(sensor for sensor in sensors if sensor is not wanted[0])
        return RadarChoice((wanted[0], *others), f"{_described(wanted[0])}, as requested")
    return _chosen(sensors, {one.name: one for one in examined}, inventory)


def _has_returns(stream: RadarStream, inventory: Inventory) -> bool:
    layout = inventory.usages[stream.topic.name].radar
    return not holds_objects(stream.topic) and layout is not None and not layout.lidar_like


def _chosen(sensors: Sequence[RadarSensor], examined: dict[str, Examined], inventory: Inventory) -> RadarChoice:
    """Choose by figures first, then by names."""
    plain = [_ahead(sensor, sensors) for sensor in sensors if examined[sensor.topics[0]].returns]
    most = max(plain, default=0.0)

    def rank(sensor: RadarSensor) -> tuple[float, ...]:
        first = examined[sensor.topics[0]]
        share = _ahead(sensor, sensors) / most if most > 0 else 1.0
        figures = (first.returns, share >= _PLENTY, sensor.figures.doppler, share >= _COMPARABLE)
        return (*figures, *radar_rank(first.stream.topic, inventory))

    ordered = tuple(sorted(sensors, key=rank, reverse=True))
    best, others = ordered[0], ordered[1:]
    if not others:
        return RadarChoice(ordered, _described(best) if len(best.topics) > 1 or best.copies else "")
    listed = "; ".join(_described(sensor) for sensor in others)
    reason = f"{_described(best)}; {_why(best, others, examined)}; not used: {listed}"
    comparable = [
        sensor
        for sensor in others
        if examined[sensor.topics[0]].returns
        and _ahead(sensor, sensors) >= _COMPARABLE * _ahead(best, sensors)
        and sensor.figures.doppler == best.figures.doppler
    ]
    return RadarChoice(ordered, reason, (_unclear(best, comparable),) if comparable else ())


def _ahead(sensor: RadarSensor, sensors: Sequence[RadarSensor]) -> float:
    """Return the static returns a scan ahead of a radar; all its returns if hardly any is static."""
    still = max(other.figures.ahead_per_scan for other in sensors) >= _NOTHING_STATIC
    return sensor.figures.ahead_per_scan if still else sensor.figures.returns_per_scan


def _why(best: RadarSensor, others: Sequence[RadarSensor], examined: dict[str, Examined]) -> str:
    rivals = [sensor for sensor in others if examined[sensor.topics[0]].returns]
    if not rivals:
        return "used because the others are tracked objects or lidars"
    mine, *theirs = (_ahead(sensor, (best, *others)) for sensor in (best, *rivals))
    if best.figures.doppler and not any(sensor.figures.doppler for sensor in rivals):
        return "used because it has Doppler"
    if mine >= max(theirs):
        return f"used because it has the most static returns ahead ({mine:.1f} a scan against {max(theirs):.1f})"
    return "used because of its name and message type; its figures are comparable"


def _unclear(best: RadarSensor, comparable: Sequence[RadarSensor]) -> DataWarning:
    listed = "; ".join(_described(sensor) for sensor in comparable)
    return DataWarning(
        "several-radars",
        f"there are {len(comparable) + 1} radars with comparable returns: {_described(best)} (used); {listed}",
        f"if another one is to be calibrated, choose it: --radar-topic {comparable[0].name}",
    )


def _about_frames(examined: Sequence[Examined]) -> list[DataWarning]:
    """Warn about topics that the user joined although their frames say that they are different sensors."""
    if len({one.frame for one in examined}) < 2:
        return []
    listed = ", ".join(f"{one.name} has frame '{one.frame}' ({figures_text(one.figures)})" for one in examined)
    return [
        DataWarning(
            "radar-frames-differ",
            f"the radar topics that are read as one have different frames: {listed}",
            "positions are not moved from one frame to the other: name only topics of one radar with --radar-topic",
        )
    ]


def _described(sensor: RadarSensor) -> str:
    """Describe a radar by its topics, frame and figures."""
    own = [name for place, name in enumerate(sensor.topics) if sensor.repeats[place] == place]
    second = [name for place, name in enumerate(sensor.topics) if sensor.repeats[place] != place]
    what = " + ".join(own)
    if second:
        what += f" with other azimuths in {' + '.join(second)}"
    if sensor.copies:
        what += f" (the same returns as {', '.join(sensor.copies)})"
    return f"{what}, frame '{sensor.frame}': {figures_text(sensor.figures)}"


def figures_text(figures: Figures) -> str:
    """Describe a radar's figures."""
    rate = "" if figures.rate_hz is None else f" at {figures.rate_hz:.1f} Hz"
    static = "no Doppler" if figures.static_share is None else f"Doppler, {100.0 * figures.static_share:.0f} % static"
    reach = f"{figures.nearest_m:.1f} to {figures.farthest_m:.1f} m"
    return f"{figures.returns_per_scan:.0f} returns a scan{rate}, {reach}, {static}"
