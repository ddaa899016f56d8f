"""The pattern generator under supervision: lift-off gate, coming to rest.

Beyond the paper: a leg may lift only while enough other feet stand, and on the
way to rest standing legs stay down while the others finish their swing.
"""

from __future__ import annotations

from bluefoot_mpc.gait.cpg import CpgInputs, CpgIntegrator, CpgState, Four

NO_COUPLING = (0.0,) * 16


def gated(
    integrator: CpgIntegrator, state: CpgState, inputs: CpgInputs, dt: float, least_stance: int
) -> CpgState:
    """Advance, but hold back legs that must not lift yet.

    With two feet to stand on, only a diagonal pair may fly. With three, one leg
    flies, and a hind leg waits for the front leg diagonal to it, which comes
    first in a walk.

    Args:
        integrator: workspace.
        state: states now.
        inputs: what drives the network.
        dt: s.
        least_stance: fewest oscillators that must stay in stance, 2 or 3.
    """
    after = integrator.advance(state, inputs, dt)
    flying = [leg for leg in range(4) if state.y2[leg] > 0.0 and after.y2[leg] > 0.0]
    use = [True] * 4
    for leg in range(4):  # front legs first
        if state.y2[leg] <= 0.0 < after.y2[leg]:
            use[leg] = _may_lift(leg, flying, after, least_stance)
            if use[leg]:
                flying.append(leg)
    return after if all(use) else merge(after, state, use)


def _may_lift(leg: int, flying: list[int], state: CpgState, least_stance: int) -> bool:
    diagonal = 3 - leg
    if least_stance >= 3:
        waits = leg >= 2 and state.y1[diagonal] < 0.0
        return not flying and not waits
    return not flying or flying == [diagonal]


def coming_to_rest(integrator: CpgIntegrator, state: CpgState, inputs: CpgInputs, dt: float) -> CpgState:
    """Advance only legs in swing, uncoupled, so that they land as fast as they can."""
    after = integrator.advance(state, inputs._replace(matrix=NO_COUPLING), dt)
    return merge(after, state, [value > 0.0 for value in state.y2])


def merge(first: CpgState, second: CpgState, use_first: list[bool]) -> CpgState:
    """Leg by leg, the state of `first` or of `second`."""

    def pick(a: Four, b: Four) -> Four:
        w, x, y, z = (p if use else q for p, q, use in zip(a, b, use_first, strict=True))
        return (w, x, y, z)

    return CpgState(y1=pick(first.y1, second.y1), y2=pick(first.y2, second.y2))
