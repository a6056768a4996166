"""What the name of a field means: its quantity and unit, with prefixes and fillers stripped."""

import re
from dataclasses import dataclass
from functools import cache

from calib_core.recordings.radar.self_describing.units import Unit, dimension_of, unit_of_tokens

__all__ = ["Meaning", "has_word", "meaning_of", "words_of"]


@dataclass(frozen=True, slots=True)
class Meaning:
    """What a name means.

    Attributes:
        quantity: x, y, z, range, azimuth, elevation, doppler, vx, vy, vz or amplitude.
        rank: 0 for the plainest names; larger for names that are used for other things too.
        unit: what the name states; None if nothing.
        sigma: it is the quantity's standard deviation.
        second: it is a second hypothesis, such as azimuth2.
        vague: the name fits azimuth and elevation alike.
        radial: a speed that can only be the radial one.
        named_axis: the axis is named by its direction, longitudinal or lateral.
    """

    quantity: str
    rank: int
    unit: Unit | None = None
    sigma: bool = False
    second: bool = False
    vague: bool = False
    radial: bool = False
    named_axis: bool = False


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


_CHUNK = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
_TYPE_PREFIXES = _words("f s m u i b n g p fl dbl flt ui my us ul si sl af mf mu ms a l k e t st")
_FILLERS = _words(
    "det detection detections target targets tgt obj object objects point pt return report meas measured measurement "
    "radar sensor data value val values track can tx rx detect est estimated rel relative raw cluster polar cart "
    "cartesian spherical sph coord coords coordinate coordinates pose loc location filtered refl reflection reflector "
    "plot peak current cur info general kinematic kinematics msg the of to from in"
)
_STATISTICS = _words("std stddev stdev sigma rms dev deviation")
_BLOCKERS = _words(
    "var variance cov covariance err error unc uncertainty accuracy acc conf confidence quality valid invalid flag flags "
    "min max maximum minimum res resolution bin idx index id ids count cnt num number offset bias scale limit accel "
    "acceleration origin ref reference prev previous pred predicted ambiguous ambig ambiguity gate width length size "
    "time age status type class classification prob probability noise fov orient orientation heading yaw pitch roll "
    "start end ego host abs absolute delta diff lever mount mounting install vehicle odom state mode threshold thresh "
    "existence history covar turn steer steering lane road boundary corner curvature dynamic property dyn prop"
)
_SECOND = _words("2 3 second secondary alt alternative alternate hyp2 amb other")
_PLAIN_SECOND = frozenset(("1", "0", "first", "primary", "hyp", "hypothesis"))

_TABLE = """
range 0: range; rng; radial range; radial distance; radial dist; slant range; range rad
range 1: distance; dist; r dist; r distance; r range
range 2: r; radius; rho
azimuth 0: azimuth; azi; azim; az; azimuth angle; azi angle; az angle; horizontal angle; hor angle; h angle; azimuth ang; az ang
azimuth 1: bearing; bearing angle
elevation 0: elevation; elev; ele; el; elevation angle; elev angle; el angle; vertical angle; ver angle; angle v; elevation ang
vague 3: phi; alpha; aoa; doa; phi angle; alpha angle
vague 4: theta; beta; theta angle; beta angle
vague 5: angle; ang
x 0: x; pos x; position x; dist x; distance x; x dist; x distance; point x; p x; px
x 1: d x; dx; range x
longitudinal 1: long dist; long distance; long pos; long position; d long; dlong; long d; long; long range; long offset
y 0: y; pos y; position y; dist y; distance y; y dist; y distance; point y; p y; py
y 1: d y; dy; range y
lateral 1: lat dist; lat distance; lat pos; lat position; d lat; dlat; lat d; lat; lat offset; lat range
z 0: z; pos z; position z; dist z; distance z; z dist; z distance; p z; pz
z 1: d z; dz; range z; vertical dist; vertical distance; vertical pos; vertical position; height; altitude
radial 0: radial velocity; radial speed; radial vel; velocity radial; vel radial; speed radial; doppler velocity; v radial
radial 0: doppler speed; doppler vel; range rate; rangerate; v doppler; doppler; velocity doppler; vel doppler
radial 0: v rad; vel rad; velocity rad; speed rad; r rate; r dot; rdot; range dot; range velocity; v r; vr; dist rate
radial 0: distance rate; range speed; vrad; rate range; rr; dop; dop vel; dop velocity
doppler 4: velocity; speed; vel; spd; v
vx 0: v x; vx; vel x; velocity x; speed x; x vel; x velocity; x dot; xdot; long vel; long velocity; v long; vlong; long speed
vy 0: v y; vy; vel y; velocity y; speed y; y vel; y velocity; y dot; ydot; lat vel; lat velocity; v lat; vlat; lat speed
vz 0: v z; vz; vel z; velocity z; speed z; z vel; z velocity; z dot; zdot
amplitude 0: snr; signal noise ratio; signal to noise; snr ratio
amplitude 1: intensity; intens
amplitude 2: rcs; radar cross section; cross section
amplitude 3: power; pow; pwr; amplitude; ampl; amp; magnitude; mag; rssi; level; strength; signal strength; signal power
"""
_SYNONYMS = {
    "longitudinal": "long", "longitude": "long", "latitude": "lat", "lon": "long", "lng": "long", "lateral": "lat",
    "vrel": "v", "vabs": "v",
    "ranges": "range", "azimuths": "azimuth", "elevations": "elevation", "angles": "angle", "velocities": "velocity",
    "speeds": "speed", "dopplers": "doppler", "distances": "distance", "intensities": "intensity", "amplitudes": "amplitude",
    "powers": "power", "xs": "x", "ys": "y", "zs": "z", "positions": "position", "snrs": "snr",
}  # fmt: skip
_AXES = {"longitudinal": "x", "lateral": "y"}
_KNOWN = {
    frozenset(words.split()): (head.split()[0], int(head.split()[1]))
    for head, _, line in (row.partition(":") for row in _TABLE.strip().splitlines())
    for words in reversed(line.split(";"))
}
_PARTS = (
    frozenset(word for key in _KNOWN for word in key if len(word) > 1) | frozenset(_SYNONYMS) | {"db", "std", "deg"}
)
_LETTERS = frozenset("xyzvr")


@cache
def words_of(name: str) -> tuple[str, ...]:
    """Split a name into lower-case words: at dots, underscores and capitals, and compounds of known words."""
    text = re.sub(r"d[Bb](sm|m)?(?![a-z])", lambda match: f"_db{match[1] or ''}_", name)
    words: list[str] = []
    for chunk in _CHUNK.findall(text):
        word = chunk.lower()
        if word.isdigit() and words and len(words[-1]) == 1 and word in ("8", "16", "32", "64"):
            words[-1] = "f"  # a type prefix such as u16
        else:
            words.extend(_split(word))
    return tuple(_SYNONYMS.get(word, word) for word in words)


def has_word(name: str, *wanted: str) -> bool:
    """Return whether one of the words is part of a name."""
    return not set(wanted).isdisjoint(words_of(name))


def _split(word: str) -> list[str]:
    """Split a compound such as posx or distlong into known words; leave any other as it is."""
    whole = word in _PARTS or word in _FILLERS or word in _BLOCKERS or word in _STATISTICS or len(word) < 3
    if whole:
        return [word]
    for size in range(len(word) - 1, 1, -1):
        head, tail = word[:size], word[size:]
        if head in _PARTS:
            rest = [tail] if tail in _LETTERS or tail in _PARTS or tail in _STATISTICS else _split(tail)
            if all(part in _PARTS or part in _LETTERS or part in _STATISTICS for part in rest):
                return [head, *rest]
    return [word]


@cache
def meaning_of(name: str) -> Meaning | None:
    """Return what a field's dotted name means; None if it is none of the quantities in use."""
    words = words_of(name)
    if not _BLOCKERS.isdisjoint(words):
        return None
    for start in _starts(words):
        kept = tuple(word for word in words[start:] if word not in _FILLERS)
        found = _with_unit(kept)
        if found is not None:
            return found
    return None


def _starts(words: tuple[str, ...]) -> range:
    """Return how many leading words may be dropped: type prefixes, only if something remains."""
    count = 0
    while count < len(words) - 1 and words[count] in _TYPE_PREFIXES:
        count += 1
    return range(count + 1)


def _with_unit(words: tuple[str, ...]) -> Meaning | None:
    for size in (3, 2, 1, 0):
        unit = unit_of_tokens(words[len(words) - size :]) if 0 < size < len(words) else None
        if size and unit is None:
            continue
        found = _plain(words[: len(words) - size])
        if found is not None and (unit is None or dimension_of(found.quantity) == unit.dimension):
            return Meaning(
                found.quantity, found.rank, unit, found.sigma, found.second, found.vague, found.radial, found.named_axis
            )
    return None


def _plain(words: tuple[str, ...]) -> Meaning | None:
    sigma = not _STATISTICS.isdisjoint(words)
    second = not _SECOND.isdisjoint(words)
    rest = frozenset(word for word in words if word not in _STATISTICS | _SECOND | _PLAIN_SECOND)
    known = _KNOWN.get(rest)
    if known is None:
        return None
    kind, rank = known
    if kind == "vague":
        return Meaning("azimuth", rank, sigma=sigma, second=second, vague=True)
    if kind == "radial":
        return Meaning("doppler", rank, sigma=sigma, second=second, radial=True)
    return Meaning(_AXES.get(kind, kind), rank, sigma=sigma, second=second, named_axis=kind in _AXES)
