"""How radar drivers and loggers name what a radar measures: one table for messages, CSV and JSON alike.

A spelling is written as words in lower case, in any order, without the words that words.FILLERS lists: "pos x" also stands for
posX, x_pos, target.position_x and f_PosX. A new spelling is added here, once.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Spelling:
    """One spelling.

    Attributes:
        words: separated by spaces.
        kind: x, y, z, range, azimuth, elevation, doppler, vx, vy, vz, snr, intensity, rcs, power or amplitude; "radial" for a
            speed that can only be the radial one, "longitudinal" or "lateral" for an axis named by its direction; among
            AMBIGUOUS also "vague", an angle that fits azimuth and elevation alike.
        rank: 0 for the plainest names; larger for names that are used for other things too.
    """

    words: str
    kind: str
    rank: int


_TABLE = """
range 0: range; rng; radial range; radial distance; radial dist; slant range; range rad; range distance
range 1: distance; dist; r dist; r distance; r range
range 2: r; radius; rho
azimuth 0: azimuth; azi; azim; az; azimuth angle; azi angle; az angle; horizontal angle; hor angle; h angle; azimuth ang; az ang
azimuth 0: azimuthal; azimuthal angle
azimuth 1: bearing; bearing angle
elevation 0: elevation; elev; ele; el; elevation angle; elev angle; el angle; vertical angle; ver angle; angle v; elevation ang
x 0: x; pos x; position x; dist x; distance x; p x; px; center x; centre x
x 1: d x; range x
longitudinal 1: longitudinal; long dist; long distance; long pos; long position; d long; dlong; long d; long range
y 0: y; pos y; position y; dist y; distance y; p y; py; center y; centre y
y 1: d y; range y
lateral 1: lateral; lat dist; lat distance; lat pos; lat position; d lat; dlat; lat d; lat range
z 0: z; pos z; position z; dist z; distance z; p z; pz; center z; centre z
z 1: d z; range z; vertical; vertical dist; vertical distance; vertical pos; vertical position
radial 0: doppler; radial velocity; radial speed; radial vel; doppler velocity; v radial; doppler speed; doppler vel
radial 0: range rate; rangerate; v doppler; v rad; vel rad; velocity rad; speed rad; r rate; r dot; rdot; range dot
radial 0: range velocity; v r; vr; vel r; velocity r; speed r; dist rate; distance rate; range speed; vrad; rr; dop; dop vel
radial 0: dop velocity
doppler 4: velocity; speed; vel; spd; v
vx 0: vx; v x; vel x; velocity x; speed x; x dot; xdot; long vel; long velocity; v long; vlong; long speed
vy 0: vy; v y; vel y; velocity y; speed y; y dot; ydot; lat vel; lat velocity; v lat; vlat; lat speed
vz 0: vz; v z; vel z; velocity z; speed z; z dot; zdot; vertical vel; vertical velocity; vertical speed
snr 0: snr; signal noise ratio; signal to noise; signal to noise ratio; signaltonoise; signaltonoiseratio; snr ratio
intensity 1: intensity; intens
rcs 2: rcs; radar cross section; cross section
power 3: power; pow; pwr; signal power; received power; rssi
amplitude 3: amplitude; ampl; amp; magnitude; mag; level; strength; signal strength; signal level
"""

_AMBIGUOUS_TABLE = """
vague 3: phi; alpha; aoa; doa; phi angle; alpha angle
vague 4: theta; beta; theta angle; beta angle
vague 5: angle; ang
x 1: dx
y 1: dy
z 1: dz; height; altitude
"""


def _spellings(table: str) -> tuple[Spelling, ...]:
    rows = (row.partition(":") for row in table.strip().splitlines())
    return tuple(
        Spelling(words.strip(), head.split()[0], int(head.split()[1]))
        for head, _, line in rows
        for words in line.split(";")
    )


SPELLINGS: tuple[Spelling, ...] = _spellings(_TABLE)
"""All spellings that mean the same wherever they are found."""

AMBIGUOUS: tuple[Spelling, ...] = _spellings(_AMBIGUOUS_TABLE)
"""Spellings of which each reader decides: a message's comments and values tell the angles apart, and its type tells that it
describes returns; in a table dx may be the size of an object, and altitude a place on Earth."""
