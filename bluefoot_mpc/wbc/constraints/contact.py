"""Standing feet do not slip: a constraint with slack, the slack weighted above every task.

As a hard equality it would make a stance that cannot hold (a leg stretched out, two
feet in one place) infeasible; with the slack substituted it costs no unknown and no row.
"""

from __future__ import annotations

from typing import Any

from bluefoot_mpc.model.symbolic import FootTerms


def standing_target(foot: FootTerms, gain: Any) -> Any:
    """3, m/s², wanted acceleration of a standing foot: none, and against what velocity it has.

    Args:
        foot: terms of the foot.
        gain: 1/s.
    """
    return -gain * foot.velocity
