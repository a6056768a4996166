"""Automatic clicks: the proposals taken as they are, if image and radar agree far beyond chance; otherwise none."""

from collections.abc import Sequence
from dataclasses import dataclass

from calib_core.measurements import Facts, ReflectorClick, Unsolvable
from calib_core.proposing.proposals import Proposal, Proposals

LEAST_WHOLE_CONFIDENCE = 0.9
"""Below this nothing is clicked."""
_MARGIN, _MARGIN_STEP = 2.0, 1.0
"""Score beyond the rival at which a pose is as probably right as not, and how fast that changes."""
_MOST_CONFIDENCE = 0.99
"""What some hundred simulated recordings without an error can show at most."""
_RIVAL_SHARE = 0.25
"""Share of its score by which a pose must be better than its rival: residuals alone make a difference of a fifth."""
_LEAST_CLICKS = 6
_LEAST_CLICK_CONFIDENCE = 0.9
_LEAST_DWELLS = 5


@dataclass(frozen=True, slots=True)
class AutomaticClicks:
    """Clicks that nobody confirmed.

    Attributes:
        clicks: one per placement that is certain enough, in order of time, with mark "snapped".
        confidence: probability that they are the reflector's, as a whole.
        agreement: how this is known: `certain` of so many `placements` fit one mounting, with a `score` that chance reaches up to
            `by_chance` and another mounting as `rival`.
    """

    clicks: tuple[ReflectorClick, ...]
    confidence: float
    agreement: Facts


def automatic_clicks(
    proposals: Proposals, placements: int, *, confirmed: Sequence[ReflectorClick] = ()
) -> AutomaticClicks | Unsolvable:
    """Take the proposals as clicks, if image and radar agree so well that a person is hardly needed.

    Args:
        proposals: with these clicks confirmed.
        placements: how many there are, those with a click included.
        confirmed: clicks of a person that count.
    """
    from scipy.special import expit

    if placements < _LEAST_DWELLS:
        return _refused("few-placements", placements=placements)
    agreement, chance = proposals.agreement, proposals.chance
    if agreement is None or chance is None:
        return _refused("no-mounting")
    if proposals.reflectors < 0.5:
        return _refused("fading")
    beyond = (1.0 - _RIVAL_SHARE) * agreement.score - agreement.rival_score
    alone = float(expit((beyond - _MARGIN) / _MARGIN_STEP))
    confidence = _MOST_CONFIDENCE * min(alone, chance.probability)
    scores = {"score": chance.score, "by_chance": chance.bound, "rival": agreement.rival_score}
    if confidence < LEAST_WHOLE_CONFIDENCE:
        return _refused("rival" if alone < chance.probability else "chance", confidence=confidence, **scores)
    certain = [proposal for proposal in proposals.ranked if proposal.confidence >= _LEAST_CLICK_CONFIDENCE]
    counts = {"certain": len(certain) + len(confirmed), "placements": placements}
    if counts["certain"] < _LEAST_CLICKS:
        return _refused("few-certain", needed=_LEAST_CLICKS, **counts)
    in_time = sorted(certain, key=lambda proposal: proposal.image_time)
    clicks = tuple(_click(proposal, number) for number, proposal in enumerate(in_time, 1))
    return AutomaticClicks(clicks, confidence, {**counts, **scores})


def _refused(why: str, **facts: float) -> Unsolvable:
    return Unsolvable("not-confident", {"why": why, **facts})


def _click(proposal: Proposal, number: int) -> ReflectorClick:
    u_px, v_px = proposal.pixel_px.tolist()
    return ReflectorClick(
        proposal.image_time, f"automatic-{number:02d}", u_px, v_px, sigma_px=proposal.sigma_px, mark="snapped"
    )
