"""Split the name of a field or column into words, and know those that say nothing about the quantity."""

import re
from functools import cache

from calib_core.recordings.field_words.spellings import AMBIGUOUS, SPELLINGS


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


TYPE_PREFIXES = _words("f s m u i b n g p fl dbl flt ui my us ul si sl af mf mu ms a l k e t st str")
"""Letters at the start of a name that encode its type or scope."""

SUBJECTS = _words(
    "radar radarpoint target targets tgt detection detections det dets point points pt pts return returns object objects obj "
    "objs reflection reflections refl cluster clusters hit hits plot plots echo echoes peak peaks track tracks data list frames "
    "scans samples messages msg header field value val values cartesian polar raw meas measured measurement"
)
"""Words for what a name belongs to, such as a return: they may precede any name."""

FILLERS = SUBJECTS | _words(
    "report sensor can tx rx detect est estimated rel relative cart spherical sph coord coords coordinate coordinates pose loc "
    "location filtered reflector current cur info general kinematic kinematics the of to from in"
)
"""Words that may stand anywhere in a name without changing its meaning."""

STATISTICS = _words("std stddev stdev sigma rms dev deviation")
"""Words that make a quantity its standard deviation."""

BLOCKERS = _words(
    "var variance cov covariance err error unc uncertainty accuracy acc conf confidence quality valid invalid flag flags "
    "min max maximum minimum res resolution bin idx index id ids count cnt num number offset bias scale limit accel "
    "acceleration origin ref reference prev previous pred predicted ambiguous ambig ambiguity gate width length size "
    "time age status type class classification prob probability fov orient orientation heading yaw pitch roll "
    "start end ego host abs absolute delta diff lever mount mounting install vehicle odom state mode threshold thresh "
    "existence history covar turn steer steering lane road boundary corner curvature dynamic property dyn prop"
)
"""Words that make a name mean something else."""

SECOND = _words("2 3 second secondary alt alternative alternate hyp2 amb other")
"""Words that make a quantity a second hypothesis."""

NUMBERS = frozenset(("1", "0", "first", "primary", "hyp", "hypothesis"))
"""Words that number hypotheses, and mean the first."""

_SYNONYMS = {
    "longitudinal": "long", "longitude": "long", "latitude": "lat", "lon": "long", "lng": "long", "lateral": "lat",
    "vrel": "v", "vabs": "v",
    "ranges": "range", "azimuths": "azimuth", "elevations": "elevation", "angles": "angle", "velocities": "velocity",
    "speeds": "speed", "dopplers": "doppler", "distances": "distance", "intensities": "intensity", "amplitudes": "amplitude",
    "powers": "power", "xs": "x", "ys": "y", "zs": "z", "positions": "position", "snrs": "snr",
}  # fmt: skip
_CHUNK = re.compile(r"[A-Z]+(?![a-zµμ])|[A-Z]?[a-zµμ]+|\d+|°")
_DECIBEL = re.compile(r"d[Bb](sm|m2|m)?(?![a-z])")
_SHORTEST = 3
_LETTERS = frozenset("xyzvr")
_PLACES = _words("coord coords coordinate coordinates")
_QUANTITIES = (
    frozenset(word for one in (*SPELLINGS, *AMBIGUOUS) for word in one.words.split() if len(word) > 1)
    | frozenset(_SYNONYMS)
    | {"db", "std", "deg"}
)
_PARTS = _QUANTITIES | {word for word in FILLERS if len(word) > _SHORTEST} - {"from"} | STATISTICS | {"rel", "rx", "tx"}
_TAILS = _QUANTITIES | _PLACES


@cache
def words_of(name: str) -> tuple[str, ...]:
    """Split a name into lower-case words: at dots, underscores and capitals, and compounds of known words."""
    text = _DECIBEL.sub(lambda match: f"_db{match[1] or ''}_", name.replace("²", "2"))
    words: list[str] = []
    for chunk in _CHUNK.findall(text):
        word = chunk.lower()
        if word.isdigit() and words and len(words[-1]) == 1 and word in ("8", "16", "32", "64"):
            words[-1] = "f"  # a type prefix such as u16
        else:
            words.extend(_split(word))
    return folded(words)


def folded(words: list[str]) -> tuple[str, ...]:
    """Replace plurals and synonyms by the words that the table of spellings uses."""
    return tuple(_SYNONYMS.get(word, word) for word in words)


def has_word(name: str, *wanted: str) -> bool:
    """Return whether one of the words is part of a name."""
    return not set(wanted).isdisjoint(words_of(name))


def _split(word: str) -> list[str]:
    """Split a compound such as posx, xpos or distlong into known words; leave any other as it is."""
    if word in _PARTS or word in FILLERS or word in BLOCKERS or len(word) < _SHORTEST:
        return [word]
    for size in range(len(word) - 1, 1, -1):
        head, tail = word[:size], word[size:]
        if head in _PARTS:
            rest = [tail] if tail in _LETTERS or tail in _PARTS else _split(tail)
            if all(part in _PARTS or part in _LETTERS for part in rest):
                return [head, *rest]
    if word[0] in _LETTERS and word[1:] in _TAILS:
        return [word[0], word[1:]]
    return [word]
