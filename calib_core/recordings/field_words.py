"""Recognise the quantity and the unit in the name of a field or column, in the spellings of radar drivers and loggers."""

import re
from dataclasses import dataclass
from functools import cache

__all__ = ["FIELD_SPELLINGS", "FieldWords", "read_field"]

_UNITS: dict[str, str] = {
    "m": "m", "meter": "m", "meters": "m", "metre": "m", "metres": "m", "cm": "cm", "mm": "mm", "km": "km",
    "rad": "rad", "rads": "rad", "radian": "rad", "radians": "rad", "mrad": "mrad",
    "deg": "deg", "degs": "deg", "degree": "deg", "degrees": "deg", "°": "deg",
    "mps": "mps", "m/s": "mps", "ms-1": "mps", "m s-1": "mps", "m/sec": "mps", "cmps": "cmps", "cm/s": "cmps",
    "km/h": "kmh", "kmh": "kmh", "kph": "kmh",
    "db": "db", "dbsm": "dbsm", "dbm2": "dbsm", "dbm²": "dbsm", "dbm": "dbm",
    "ns": "ns", "nsec": "ns", "nsecs": "ns", "nanosec": "ns", "nanosecs": "ns", "nanosecond": "ns", "nanoseconds": "ns",
    "us": "us", "µs": "us", "usec": "us", "usecs": "us", "microsec": "us", "microsecond": "us", "microseconds": "us",
    "ms": "ms", "msec": "ms", "msecs": "ms", "millisec": "ms", "millisecond": "ms", "milliseconds": "ms",
    "s": "s", "sec": "s", "secs": "s", "second": "s", "seconds": "s",
}  # fmt: skip
_LENGTH, _ANGLE = frozenset({"m", "cm", "mm", "km"}), frozenset({"rad", "deg", "mrad"})
_SPEED, _DECIBEL = frozenset({"mps", "kmh", "cmps"}), frozenset({"db", "dbsm", "dbm"})
_TIME = frozenset({"ns", "us", "ms", "s"})
_UNITS_OF = {
    "x": _LENGTH, "y": _LENGTH, "z": _LENGTH, "range": _LENGTH, "sigma_range": _LENGTH,
    "azimuth": _ANGLE, "elevation": _ANGLE, "sigma_azimuth": _ANGLE, "sigma_elevation": _ANGLE,
    "doppler": _SPEED, "vx": _SPEED, "vy": _SPEED, "vz": _SPEED,
    "snr": _DECIBEL, "rcs": _DECIBEL, "power": _DECIBEL, "amplitude": _DECIBEL, "intensity": _DECIBEL, "time": _TIME,
}  # fmt: skip

FIELD_SPELLINGS: dict[str, tuple[str, ...]] = {
    "time": ("time", "timestamp", "stamp", "t", "epoch", "unixtime", "unixtimestamp", "headerstamp", "datetime", "utc",
             "utctime", "timeutc", "timeofmeasurement", "measurementtime", "rostime", "ts", "gpstime", "timegps"),
    "sec": ("sec", "secs", "seconds", "stampsec", "stampsecs", "timesec", "timesecs", "headerstampsec", "headerstampsecs",
            "timestampsec", "timestampsecs", "epochsec", "tvsec"),
    "nanosec": ("nanosec", "nanosecs", "nsec", "nsecs", "nanoseconds", "stampnanosec", "stampnsec", "stampnsecs", "timensec",
                "timenanosec", "headerstampnanosec", "headerstampnsec", "headerstampnsecs", "timestampnsec", "timestampnanosec",
                "tvnsec"),
    "date": ("date", "day"),
    "frame": ("frame", "frameid", "framenumber", "framenr", "frameno", "frameindex", "frameidx", "scan", "scanid", "scannumber",
              "scanindex", "cycle", "cyclecounter"),
    "x": ("x", "posx", "xpos", "positionx", "xposition", "px", "coordx", "distx", "distancex", "distlong", "longdist",
          "longitudinal", "longitudinaldistance", "longitudinaldist", "distlongitudinal", "distancelongitudinal",
          "longitudinalposition", "xcoord", "xcoordinate", "cartesianx", "locationx", "poseposex", "poseposepositionx",
          "posepositionx", "centerx", "centrex"),
    "y": ("y", "posy", "ypos", "positiony", "yposition", "py", "coordy", "disty", "distancey", "distlat", "latdist", "lateral",
          "lateraldistance", "lateraldist", "distlateral", "distancelateral", "lateralposition", "ycoord", "ycoordinate",
          "cartesiany", "locationy", "poseposey", "poseposepositiony", "posepositiony", "centery", "centrey"),
    "z": ("z", "posz", "zpos", "positionz", "zposition", "pz", "coordz", "distz", "distancez", "zcoord",
          "zcoordinate", "vertical", "verticaldistance", "cartesianz", "locationz", "poseposez", "poseposepositionz",
          "posepositionz", "centerz", "centrez"),
    "range": ("range", "r", "distance", "dist", "rng", "rho", "radialdistance", "radius", "slantrange", "targetrange",
              "rangedistance"),
    "azimuth": ("azimuth", "az", "azimuthangle", "azi", "angleazimuth", "azimuthal", "bearing", "theta", "azangle", "angle",
                "horizontalangle", "anglehorizontal", "anglehor"),
    "elevation": ("elevation", "el", "elevationangle", "elev", "ele", "angleelevation", "phi", "elangle", "verticalangle",
                  "anglevertical", "anglever"),
    "doppler": ("doppler", "rangerate", "radialspeed", "radialvelocity", "velocityradial", "dopplervelocity", "dopplerspeed",
                "vr", "vradial", "vrad", "velocity", "velr", "speedradial", "relativeradialvelocity", "relradialvelocity",
                "vdoppler", "rrate", "speed", "vel", "v", "rdot"),
    "vx": ("vx", "velocityx", "velx", "xvelocity", "vrelx", "vlong", "vrellong", "longitudinalvelocity", "speedx"),
    "vy": ("vy", "velocityy", "vely", "yvelocity", "vrely", "vlat", "vrellat", "lateralvelocity", "speedy"),
    "vz": ("vz", "velocityz", "velz", "zvelocity", "vrelz", "speedz"),
    "snr": ("snr", "signaltonoise", "signaltonoiseratio"),
    "rcs": ("rcs", "radarcrosssection", "crosssection"),
    "power": ("power", "pow", "rxpower", "receivedpower", "signalpower"),
    "amplitude": ("amplitude", "amp", "magnitude", "mag", "signalstrength", "strength"),
    "intensity": ("intensity",),
    "sigma_range": ("sigmarange", "rangestd", "rangesigma", "stdrange", "rangeaccuracy", "rangestddev"),
    "sigma_azimuth": ("sigmaazimuth", "azimuthstd", "azimuthsigma", "stdazimuth", "azimuthaccuracy", "azimuthstddev"),
    "sigma_elevation": ("sigmaelevation", "elevationstd", "elevationsigma", "stdelevation", "elevationaccuracy",
                        "elevationstddev"),
}  # fmt: skip
"""Spellings of each quantity without case, separators, prefixes and units; the first is the one in the documentation."""

_QUANTITY = {
    spelling: (quantity, rank) for quantity, spellings in FIELD_SPELLINGS.items() for rank, spelling in enumerate(spellings)
}  # fmt: skip
_LONGEST_NAME = 500
"""No name of a field is longer; the patterns take the cube of the length of what is none."""
_BRACKETS = re.compile(r"(?P<name>.*?)\s*[\[(<]\s*(?P<unit>[^\])>]*?)\s*[\])>]\s*")
_HUNGARIAN = frozenset({"f", "s", "n", "d", "i", "u", "b", "m", "fl", "db", "ui", "dbl", "flt", "p", "str", "val"})
_SUBJECTS = frozenset({
    "radar", "target", "targets", "detection", "detections", "det", "point", "points", "pts", "return", "returns", "object",
    "obj", "reflection", "reflections", "data", "radarpoint", "peak", "peaks", "track", "frames", "scans", "samples", "messages",
    "msg", "header", "cartesian", "polar", "field", "values", "list", "raw", "meas", "measured", "measurement",
})  # fmt: skip


@dataclass(frozen=True, slots=True)
class FieldWords:
    """What the name of a field says.

    Attributes:
        quantity: a key of FIELD_SPELLINGS.
        unit: m, cm, mm, km, rad, deg, mrad, mps, cmps, kmh, db, dbsm, dbm, ns, us, ms or s; "" if the name has none; any
            other word in brackets or after the quantity as it is written.
        rank: the place of its spelling among those of its quantity; 0 is the one in the documentation.
    """

    quantity: str
    unit: str
    rank: int

    @property
    def unit_is_known(self) -> bool:
        """Whether the unit is one of the quantity's."""
        return self.unit in _UNITS_OF.get(self.quantity, frozenset())


@cache
def read_field(written: str) -> FieldWords | None:
    """Recognise a name such as x_m, "Range [m]", f_Azimuth_deg, detections.posX or velocityRadial; None if unknown.

    A unit may follow in brackets or after a separator. Letters that encode a type (f_) and the word for a return
    (detections.) are skipped.
    """
    text = written[:_LONGEST_NAME].strip().strip("#%\"'\ufeff ").strip()
    bracketed = _BRACKETS.fullmatch(text)
    if bracketed:
        found = _named(_words(bracketed["name"]))
        unit = bracketed["unit"].strip().lower().replace("²", "2")
        return FieldWords(found[0], _UNITS.get(unit, unit), found[1]) if found else None
    words = _words(text)
    if len(words) > 1 and words[-1] in ("value", "val"):
        words = words[:-1]
    whole = _named(words)
    if whole and whole[0] not in ("sec", "nanosec"):
        return FieldWords(whole[0], "", whole[1])
    for length in (2, 1):
        if len(words) > length:
            unit = _UNITS.get(("/" if length == 2 else "").join(words[-length:]), "")
            found = _named(words[:-length]) if unit else None
            if found and unit in _UNITS_OF.get(found[0], frozenset()):
                return FieldWords(found[0], unit, found[1])
    if whole:
        return FieldWords(whole[0], "", whole[1])
    found = _named(words[:-1]) if len(words) == 2 and words[0] not in _HUNGARIAN else None
    return FieldWords(found[0], words[-1], found[1]) if found and found[0] in _UNITS_OF and found[1] == 0 else None


def _words(text: str) -> tuple[str, ...]:
    """Split a name at separators and capitals: f_RangeRate -> f, range, rate."""
    spaced = re.sub(r"([a-z0-9])([A-Z])", r"\1 \2", text.replace("²", "2").replace("dB", "db"))
    return tuple(word.lower() for word in re.split(r"[^A-Za-z0-9°µ]+", spaced) if word)


def _named(words: tuple[str, ...]) -> tuple[str, int] | None:
    """Return the quantity that words name, with its rank; prefixes are dropped one at a time."""
    for start in range(len(words)):
        if any(word not in _HUNGARIAN and word not in _SUBJECTS for word in words[:start]):
            return None
        found = _QUANTITY.get("".join(words[start:]))
        if found:
            return found
    return None
