"""Settings of the state estimator, one small record for each part."""

from __future__ import annotations

from dataclasses import dataclass, field

from bluefoot_mpc.settings import require_finite, require_nonnegative, require_positive, require_range


@dataclass(frozen=True, kw_only=True, slots=True)
class ImuConfig:
    """What the filter believes of the inertial sensors (hardware notes, sensor table)."""

    mount: tuple[float, float, float] = (0.0, 0.0, 0.02)  # m, in the base frame
    gyro_noise: float = 0.01  # rad/s, white, of one sample
    gyro_bias: float = 0.0115  # rad/s, deviation of a uniform ±0.02
    gyro_drift: float = 1.3e-4  # rad/s per root second: 0.001 in a minute
    accel_noise: float = 0.15  # m/s², white, of one sample; the data sheet's and a half
    shake: float = 0.1  # share of the force's spread within a frame that counts as noise
    accel_bias: float = 0.0173  # m/s², deviation of a uniform ±0.03
    accel_drift: float = 1e-4  # m/s² per root second
    lost_after: float = 0.1  # s without a usable sample until the estimate is not healthy
    lost_rate: float = 0.5  # rad/s, assumed angular velocity while samples are missing
    lost_accel: float = 2.0  # m/s², assumed acceleration while samples are missing

    def __post_init__(self) -> None:
        require_finite(mount=self.mount)
        require_positive(
            gyro_noise=self.gyro_noise, gyro_bias=self.gyro_bias, accel_noise=self.accel_noise,
            accel_bias=self.accel_bias, lost_after=self.lost_after, lost_rate=self.lost_rate,
            lost_accel=self.lost_accel,
        )  # fmt: skip
        require_nonnegative(shake=self.shake, gyro_drift=self.gyro_drift, accel_drift=self.accel_drift)


@dataclass(frozen=True, kw_only=True, slots=True)
class ContactConfig:
    """How switches and stance feet are used."""

    debounce: float = 0.03  # s, edges back within this time are chatter
    probation: int = 1  # frames a foot must stand still before it counts
    joint_noise: float = 0.0015  # rad, deviation of the rounding to one step
    foot_noise: float = 0.0003  # m, of a foot point beyond the joints' share
    slip: float = 0.0007  # m per root second, wander of a standing foot
    loose: float = 0.02  # m per root second, the same of a foot about to lift
    lifting: float = 0.12  # s after another foot's touch for which the longest standing are about to lift
    gate: float = 6.0  # squared deviations (3 axes) beyond which a foot slips or lifts
    blind_after: float = 0.2  # s without a standing foot until rest is assumed
    blind_speed: float = 0.5  # m/s, deviation of that assumption

    def __post_init__(self) -> None:
        require_nonnegative(
            debounce=self.debounce, probation=self.probation, slip=self.slip, lifting=self.lifting
        )
        require_positive(
            joint_noise=self.joint_noise, foot_noise=self.foot_noise, gate=self.gate, loose=self.loose,
            blind_after=self.blind_after, blind_speed=self.blind_speed,
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True, slots=True)
class JointFilterConfig:
    """Tracking filter of joint angles; its lag is (alpha / beta - 1/2) periods.

    The defaults (6 ms at 50 Hz) had the smallest error while trotting: at four
    steps of the servo a period, lag costs more than rounding does.
    """

    alpha: float = 1.0  # share of a new angle
    beta: float = 1.25  # share of a new difference; above 1 it looks ahead
    memory: float = 0.1  # s, decay of the speed of a joint that does not answer
    lost_after: float = 0.1  # s without an answer until a leg is not used

    def __post_init__(self) -> None:
        require_range(0.05, 1.0, alpha=self.alpha)
        require_range(0.05, 1.5, beta=self.beta)
        require_positive(memory=self.memory, lost_after=self.lost_after)


@dataclass(frozen=True, kw_only=True, slots=True)
class HeadingConfig:
    """How the magnetometer bounds the yaw, relative to the starting heading."""

    enabled: bool = True
    noise: float = 0.02  # of the field, deviation of one sample
    hard_iron: float = 0.0173  # of the field, deviation of a uniform ±3 %
    interval: float = 0.1  # s between corrections
    reference_samples: int = 25  # averaged for the starting heading
    min_horizontal: float = 0.15  # of the field; less gives no heading
    gate: float = 0.2  # of the reference, change of the horizontal strength beyond which a sample is skipped

    def __post_init__(self) -> None:
        require_positive(
            noise=self.noise, hard_iron=self.hard_iron, reference_samples=self.reference_samples,
            min_horizontal=self.min_horizontal, gate=self.gate, interval=self.interval,
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True, slots=True)
class RestConfig:
    """When the robot counts as standing still, so that the gyro shows its bias."""

    time: float = 0.2  # s that the joints must have rested
    joint_move: float = 0.006  # rad, one step of the servo is still rest
    rate_spread: float = 0.03  # rad/s, spread of the samples of one frame
    rate: float = 0.02  # rad/s, mean rate that rest may show once the bias is known
    noise: float = 0.01  # rad/s, deviation of one frame's mean rate at rest, sway included

    def __post_init__(self) -> None:
        require_positive(
            time=self.time, joint_move=self.joint_move, rate_spread=self.rate_spread,
            rate=self.rate, noise=self.noise,
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True, slots=True)
class GroundConfig:
    """How the plane under the feet is fitted."""

    memory: float = 1.0  # s, time constant with which frames are forgotten
    min_spread: float = 0.03  # m, RMS distance of the feet from one line that makes it known

    def __post_init__(self) -> None:
        require_positive(memory=self.memory, min_spread=self.min_spread)


@dataclass(frozen=True, kw_only=True, slots=True)
class LevelConfig:
    """When the floor counts as level, and how much that weighs."""

    enabled: bool = True
    slope: float = 0.0055  # rise per metre (0.3°) that the accelerometer's bias may feign on a level floor
    trust: float = 0.5  # s for which the plane must have looked level
    distrust: float = 5.0  # s after a floor that was not level, until one may be level again
    noise: float = 0.0006  # m, deviation of two feet's heights: 0.1° between diagonal feet
    interval: float = 0.1  # s between comparisons
    memory: float = 3.0  # s, over which the spread of the heights is averaged
    gate: float = 16.0  # squared deviations beyond which two feet do not stand on the same level
    doubt: float = 0.5  # s of such feet after which the floor is no longer level
    max_bias: float = 3.0  # deviations of the accelerometer's bias that a level floor may ask for

    def __post_init__(self) -> None:
        require_positive(
            slope=self.slope,
            noise=self.noise,
            interval=self.interval,
            memory=self.memory,
            gate=self.gate,
            max_bias=self.max_bias,
        )
        require_nonnegative(trust=self.trust, doubt=self.doubt, distrust=self.distrust)


@dataclass(frozen=True, kw_only=True, slots=True)
class EstimatorConfig:
    """Settings of the whole estimator."""

    imu: ImuConfig = field(default_factory=ImuConfig)
    contact: ContactConfig = field(default_factory=ContactConfig)
    joint: JointFilterConfig = field(default_factory=JointFilterConfig)
    heading: HeadingConfig = field(default_factory=HeadingConfig)
    rest: RestConfig = field(default_factory=RestConfig)
    ground: GroundConfig = field(default_factory=GroundConfig)
    level: LevelConfig = field(default_factory=LevelConfig)
    max_step: float = 0.1  # s, a longer step between frames, or one backwards, is a jump of the clock
    initial_tilt: float = 0.05  # rad, deviation of the attitude from the first samples
    initial_speed: float = 0.05  # m/s, deviation at the start

    def __post_init__(self) -> None:
        require_positive(
            max_step=self.max_step, initial_tilt=self.initial_tilt, initial_speed=self.initial_speed
        )
