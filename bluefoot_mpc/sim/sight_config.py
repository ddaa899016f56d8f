"""Configuration of the simulated LIDAR and camera: assumptions, in the range of what such sensors do."""

from __future__ import annotations

from dataclasses import dataclass

from bluefoot_mpc.settings import require_nonnegative, require_range


@dataclass(frozen=True, kw_only=True, slots=True)
class LidarConfig:
    """The LIDAR of a simulated robot and its errors."""

    enabled: bool = False  # frames carry scans
    noise_near: float = 0.010  # m, standard deviation below near_range
    near_range: float = 1.0  # m
    noise_far: float = 0.01  # of the range, standard deviation beyond near_range
    dropouts: float = 0.005  # share of rays without an echo
    jitter_deg: float = 0.05  # degrees, standard deviation of a ray's bearing
    # degrees; how the sensor is really turned (roll, pitch, yaw), beside what the robot's parameter file says
    mount_error_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    # m; by how much it really sits elsewhere (forward, left, up)
    mount_error_m: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        require_nonnegative(
            noise_near=self.noise_near, near_range=self.near_range, noise_far=self.noise_far,
            jitter_deg=self.jitter_deg,
        )  # fmt: skip
        require_range(0.0, 1.0, dropouts=self.dropouts)
        for name, angle in zip(("roll", "pitch", "yaw"), self.mount_error_deg, strict=True):
            require_range(-20.0, 20.0, **{f"mount_error_deg ({name})": angle})
        for name, away in zip(("forward", "left", "up"), self.mount_error_m, strict=True):
            require_range(-0.05, 0.05, **{f"mount_error_m ({name})": away})


@dataclass(frozen=True, kw_only=True, slots=True)
class CameraConfig:
    """The forward camera of a simulated robot and its errors.

    A picture arrives one picture period after its exposure, as from a camera
    that sends one picture while it takes the next.
    """

    enabled: bool = False  # frames carry pictures
    rate: float = 10.0  # pictures a second; rounded to whole physics steps between them
    width: int = 640  # pixels
    height: int = 480  # pixels
    exposure: float = 0.10  # ± share of the brightness, uniform, each picture its own

    def __post_init__(self) -> None:
        require_range(0.1, 60.0, rate=self.rate)
        require_range(16, 1920, width=self.width, height=self.height)
        require_range(0.0, 0.9, exposure=self.exposure)

    @property
    def period(self) -> float:
        """Time between two pictures, and from exposure to arrival, s."""
        return 1.0 / self.rate
