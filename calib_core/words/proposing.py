"""What the search for placements and automatic clicks say: a row for each code of their outcomes."""

from calib_core.measurements import DataWarning, Facts
from calib_core.results.actions import MeasureCameraPosition
from calib_core.words.remark import Remark, by_code, remark
from calib_core.words.text import count, option, say
from calib_core.words.warnings import warning_remark


def no_frames() -> Remark:
    return remark("the recording contains no camera frames", "add the camera's recording")


def too_few_placements(*, placements: int, needed: int) -> Remark:
    return remark(
        f"the radar shows {count(placements, 'placement')}, and at least {needed} are needed: a placement is a strong return "
        "that appears, stands still for two seconds or longer, and disappears",
        "let the reflector stand still for some seconds at each of ten or more places, and check with cocalib info that the "
        "radar's topic and options are right; or click the reflector on the page",
    )


def no_frames_in_placements(*, placements: int, first_s: float, last_s: float) -> Remark:
    return remark(
        f"the camera recorded no frame during any of the {placements} placements of the radar: its frames run from "
        f"{first_s:+.1f} s to {last_s:+.1f} s of the first placement",
        "check that both recordings are of the same time, and that their clocks agree",
    )


def nothing_proposed(*, placements: int) -> Remark:
    return remark(
        f"none of the {placements} placements shows where in the image the reflector stood",
        say(
            "click the first two placements yourself, on the page or with --clicks: they show how large the reflector is, what "
            "it looks like and where the camera points; check the intrinsics, {axes} and that both recordings are of one time",
            axes=option("radar_axes"),
        ),
    )


def not_confident(
    *,
    why: str = "",
    placements: int = 0,
    certain: int = 0,
    needed: int = 0,
    score: float = 0.0,
    by_chance: float = 0.0,
    rival: float = 0.0,
    confidence: float = 0.0,
    contradiction: DataWarning | None = None,
    camera_away_m: float = 0.0,
) -> Remark:
    if contradiction is not None:
        return remark(
            "the clicks are unconfirmed, and the pose from them is contradictory: "
            + warning_remark(contradiction).message,
            "open the recording on the page and confirm what it proposes, from one click on",
        )
    if camera_away_m:
        return remark(
            f"the clicks are unconfirmed, and by them the camera is at least {camera_away_m:.1f} m from the radar: something "
            "that was carried along with the reflector would look the same",
            say(
                "if it is that far away, measure its position with a tape ({position}); else look at the clicks on the page",
                position=option("solving.camera_position"),
            ),
            MeasureCameraPosition(),
        )
    shown = count(placements, "placement")
    unclear = "images and radar do not agree on one mounting clearly enough, "
    figures = f"nearly as well ({_scores(score, by_chance, rival)}; confidence {confidence:.2f})"
    messages = {
        "few-placements": f"the radar shows {shown}, and agreement by chance needs more to be ruled out",
        "no-mounting": "images and radar agree on no mounting; do both belong to the same recording?",
        "fading": "what stood still may be a person: its echo fades, or no strength is reported and no inner corner seen",
        "chance": f"{unclear}chance would do {figures}",
        "rival": f"{unclear}another mounting fits {figures}",
        "few-certain": f"{certain} of {shown} are certain enough, and {needed} are needed",
    }
    return remark(messages[why], "confirm one or two proposals, or click the reflector in a few frames")


OUTCOMES = by_code(no_frames, no_frames_in_placements, not_confident, nothing_proposed, too_few_placements)


def agreement_text(agreement: Facts) -> str:
    """Say what the confidence in automatic clicks rests on; nothing was placed without an agreement."""
    if not agreement:
        return "no placement is left to propose"
    scores = _scores(agreement["score"], agreement["by_chance"], agreement["rival"])
    return f"{agreement['certain']} of {count(agreement['placements'], 'placement')} agree on one mounting ({scores})"


def _scores(score: float, by_chance: float, rival: float) -> str:
    return f"score {score:.0f}, by chance up to {by_chance:.0f}, another mounting {rival:.0f}"
