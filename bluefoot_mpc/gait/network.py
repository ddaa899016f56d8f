"""The pattern generator under supervision: lift-off gate, coming to rest.

Beyond the paper: a leg may lift only while enough other feet stand, and on the
way to rest standing legs stay down while the others finish their swing.
"""

from __future__ import annotations

from dataclasses import replace

from bluefoot_mpc.gait.cpg import CpgInputs, CpgIntegrator, CpgState, Four

NO_COUPLING = (0.0,) * 16


def gated(
    integrator: CpgIntegrator, state: CpgState, inputs: CpgInputs, dt: float, least_stance: int
) -> CpgState:
    """Advance, but hold back legs whose lift-off would leave too few feet standing.

    Args:
        integrator: workspace.
        state: states now.
        inputs: what drives the network.
        dt: s.
        least_stance: fewest oscillators that must stay in stance.
    """
    after = integrator.advance(state, inputs, dt)
    flying = sum(value > 0.0 for value in after.y2)
    if flying <= 4 - least_stance:
        return after
    held = [True] * 4
    room = 4 - least_stance - sum(a > 0.0 and b > 0.0 for a, b in zip(state.y2, after.y2, strict=True))
    risers = [leg for leg in range(4) if state.y2[leg] <= 0.0 < after.y2[leg]]
    risers.sort(key=lambda leg: -after.y2[leg])
    for leg in risers[max(0, room) :]:
        held[leg] = False
    return merge(after, state, held)


def coming_to_rest(integrator: CpgIntegrator, state: CpgState, inputs: CpgInputs, dt: float) -> CpgState:
    """Advance only legs in swing, uncoupled, so that they land as fast as they can."""
    after = integrator.advance(state, replace(inputs, matrix=NO_COUPLING), dt)
    return merge(after, state, [value > 0.0 for value in state.y2])


def merge(first: CpgState, second: CpgState, use_first: list[bool]) -> CpgState:
    """Leg by leg, the state of `first` or of `second`."""

    def pick(a: Four, b: Four) -> Four:
        w, x, y, z = (p if use else q for p, q, use in zip(a, b, use_first, strict=True))
        return (w, x, y, z)

    return CpgState(y1=pick(first.y1, second.y1), y2=pick(first.y2, second.y2))
