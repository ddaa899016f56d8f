"""What the preview needs on one tick."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bluefoot_mpc.types import ContactSchedule, FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class PreviewInputs:
    """Contacts ahead and what is wanted of the centre of mass, in the b' of now.

    Attributes:
        schedule: n samples, the first one interval ahead, as footholds stand in
            the frame of now.
        nominal: (n, 2) m, where the centre of mass would be without any sway:
            its reference, and the middle of its reach.
        velocity: (n, 2) m/s over the ground, wanted of the centre of mass; None
            for the rate of change of `nominal`.
        zmp: (n, 2) m, wanted ZMP; None leads `nominal` into the support by the
            configured depth, and from there on to the middle by the configured share.
        state: (3, 2) position, velocity and acceleration of the centre of mass
            now; None takes them from the previous plan.
        height: m or (n,) m, vertical distance of the centre of mass above the
            ground plane; None for the configured one.
        rise: (n,) m/s², its second derivative; None for a constant height.
        slope: (2,) rise of the ground plane per metre along x and y of b'; None for none.
            It matters only when gravity is not along z as well: a centre of mass
            that follows the plane meets level ground's law in horizontal axes.
        gravity: (3,) m/s², in the axes of the plan; None for straight down.
        reach: (n, 2) m, half the box around `nominal` that the legs allow, along
            and across the heading; None for the configured one.
        heading: (n,) rad, direction of that box; None for the x axis.
        margin: m, between the edge of the support and the region, and m inside that region where the ZMP
            is wanted; None for the configured ones.
        pose: (3,) x (m), y (m), yaw (rad) of the b' of now in any frame at rest;
            carries the previous plan over.
    """

    schedule: ContactSchedule
    nominal: FloatArray
    velocity: FloatArray | None = None
    zmp: FloatArray | None = None
    state: FloatArray | None = None
    height: float | FloatArray | None = None
    rise: FloatArray | None = None
    slope: FloatArray | None = None
    gravity: FloatArray | None = None
    reach: FloatArray | None = None
    heading: FloatArray | None = None
    margin: tuple[float, float] | None = None
    pose: FloatArray = field(default_factory=lambda: np.zeros(3))
