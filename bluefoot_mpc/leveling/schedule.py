"""When the compensator acts and when the network learns."""

from __future__ import annotations

from bluefoot_mpc.leveling.config import ScheduleConfig


def wants_on(time: float, config: ScheduleConfig) -> bool:
    """Whether the compensator is to act at `time` (s since the start of the run)."""
    if config.on == 0.0:
        return time >= config.start + config.off
    since = time - config.start
    # Sums of periods fall short of a window's edge by rounding.
    return since >= 0.0 and (since + 1e-6) % (config.off + config.on) >= config.off


def may_learn(acts: bool, config: ScheduleConfig) -> bool:
    """Whether the network may learn; `acts` while the compensator acts, fades, or pauses in an on window."""
    return config.learn == "always" or (config.learn == "off" and not acts)


def faded(share: float, wanted: bool, dt: float, config: ScheduleConfig) -> float:
    """`share` moved towards acting fully or not at all, as fast as the fade allows."""
    step = dt / config.fade
    return min(1.0, share + step) if wanted else max(0.0, share - step)
