"""Wheels and legs on one page that opens offline: python scripts/wheels.py [runs/wheels.html].

Like a notebook: short lines of Python with what they give, and pictures made from them. The
ready robots with their zero-motion lines and centres of rotation, an Ackermann turn, the
mecanum wheels' directions, a drive with lagging motors, a balancing run, gait diagrams, and
what to do when a Jacobian has no inverse. docs/wheels.md leads to the functions.
"""

from __future__ import annotations

import argparse
import functools
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
import wheels_drawing as draw
from plotly.subplots import make_subplots

from bluefoot_mpc import wheels
from bluefoot_mpc.exceptions import BlueFootError
from bluefoot_mpc.viz.style import BAD, COM, COMMAND, ESTIMATE, GOOD, LEG_COLOURS, NEUTRAL, TRUTH
from bluefoot_mpc.wheels import balance, formulas, frames, gaits, legs, ready, solving

SIDEWAYS = {
    "omni": (0.07, -0.04),
    "mecanum": (0.07, -0.04),
    "omni_steer": (0.08, 0.03),
    "two_steer": (0.08, 0.03),
}
DIRECTIONS = {
    "forward": (1, 0, 0), "backward": (-1, 0, 0), "left": (0, 1, 0), "right": (0, -1, 0),
    "clockwise": (0, 0, -1), "counter-clockwise": (0, 0, 1),
}  # fmt: skip
LEAD = (
    "Robot frame: x forward, y left. A twist is (m/s forward, m/s to the left, rad/s to the left); wheel "
    "speeds are in rad/s. In the pictures forward is up."
)
NAMES = vars(wheels) | {"np": np, "math": math, "formulas": formulas, "ready": ready, "solving": solving}
cells = functools.partial(draw.cells, NAMES)


def main() -> int:
    parser = argparse.ArgumentParser(
        description="Draw wheeled robots and legs on one page that opens offline."
    )
    parser.add_argument("path", nargs="?", type=Path, default=Path("runs/wheels.html"), help="file to write")
    path = parser.parse_args().path
    parts = (constraints, robots, car, mecanum, driving, balancing, walking, equations)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # Opened before the work, so that a wrong path is known at once.
        with path.open("w", encoding="utf-8") as file:
            file.write(draw.document("Wheels and legs", LEAD, (part() for part in parts)))
    except BlueFootError as error:
        print(f"error: {error}", file=sys.stderr)
        return error.exit_status
    except OSError as error:
        print(f"error: cannot write {path}: {error.strerror}; give another path", file=sys.stderr)
        return 2
    print(f"wrote {path}")
    return 0


def constraints() -> str:
    return draw.section(
        "Rolling and sliding",
        "Each wheel gives two rows. Rolling: along v the contact moves as fast as the wheel turns. Sliding: "
        "along its axis it does not move. All rolling rows are J1, the sliding rows of fixed and steered "
        "wheels are C1.",
        cells(
            "rolling_matrix(ready.differential(half_track=0.1))",
            "sliding_matrix(ready.differential(half_track=0.1))",
            "inverse(ready.differential(), np.array([0.1, 0, 0.5])).speeds",
            "forward(ready.differential(), np.array([2.0, 4.0])).twist",
        ),
    )


def robots() -> str:
    titles = [name.replace("_", " ") for name in wheels.READY]
    figure = make_subplots(2, 5, subplot_titles=titles, horizontal_spacing=0.02, vertical_spacing=0.09)
    rows = []
    for index, (name, make) in enumerate(wheels.READY.items()):
        robot, twist = make(), np.array([*SIDEWAYS.get(name, (0.08, 0.0)), 0.4])
        command = wheels.inverse(robot, twist)
        traces = draw.robot_traces(robot, command.steering, twist)
        draw.add(figure, traces, index // 5 + 1, index % 5 + 1)
        deltas = [f(robot, command.steering) for f in (wheels.delta_M, wheels.delta_m, wheels.delta_s)]
        tests = [f(robot, command.steering) for f in (wheels.holonomic, wheels.omnidirectional)]
        turned = [a for w, a in zip(robot.wheels, command.steering, strict=True) if w.turns]
        rows.append(
            [titles[index], *deltas, *("yes" if test else "no" for test in tests),
             ", ".join(f"{value:g}" for value in twist),
             ", ".join(f"{speed:.1f}" for speed in command.speeds),
             ", ".join(f"{math.degrees(a):.0f}°" for a in turned) or "–"]
        )  # fmt: skip
    draw.seen_from_above(figure, (-0.245, 0.135), (-0.125, 0.235))
    figure.update_layout(height=500)
    marks = (
        (f'<b style="color:{ESTIMATE}">■</b>', "driven"),
        (f'<b style="color:{NEUTRAL}">■</b>', "not driven"),
        (f'<b style="color:{COMMAND}">□</b>', "turns: steered, castor"),
        (f'<b style="color:{BAD}">●</b>', "centre of rotation"),
        ("dotted:", "zero-motion lines, along the axes of wheels that may not slide"),
        ("stripes:", "axes of the rollers on the floor"),
    )
    key = '<p class="key">' + "".join(f"<span>{mark} {what}</span>" for mark, what in marks) + "</p>"
    degrees = [f"δ<sub>{kind}</sub>" for kind in "Mms"]
    head = ["", *degrees, "holonomic", "omnidirectional", "twist", "wheel speeds, rad/s", "turned to"]
    return draw.section(
        "Ready robots",
        "All turn to the left about the red point. Where it may lie is what makes robots differ: anywhere "
        "for omni and mecanum (δ<sub>m</sub> = 3), on the axle of a differential drive (2), at one point "
        "only once a car's wheels are turned (1).",
        key + draw.picture(figure) + draw.table(head, rows),
    )


def car() -> str:
    robot, twist = ready.ackermann(), np.array([0.1, 0.0, 0.1 / 0.30])
    steering, centre = wheels.inverse(robot, twist).steering, wheels.icr_of(twist).point
    titles = ["Four wheels about one point", "Angles of inner and outer wheel"]
    figure = make_subplots(1, 2, column_widths=[0.55, 0.45], horizontal_spacing=0.09, subplot_titles=titles)
    draw.add(figure, draw.robot_traces(robot, steering, twist))
    around = np.array([(math.cos(t), math.sin(t)) for t in np.linspace(-2.3, -0.2, 80)])
    for wheel, leg in zip(robot.wheels, ("RL", "RR", "FL", "FR"), strict=True):
        radius, colour = float(np.hypot(*(wheel.position - centre))), LEG_COLOURS[leg]
        beside = wheel.position + np.array([0.0, 0.06 * np.sign(wheel.position[1])])
        text = draw.label(beside, f"{radius:.3f} m", colour)
        draw.add(figure, [draw.outline(centre + radius * around, colour, 1.2), text])
    draw.seen_from_above(figure, (-0.40, 0.22), (-0.16, 0.32), row=1, col=1)
    middle = np.radians(np.linspace(0.0, 37.0, 75))
    both = np.degrees([formulas.ackermann_angles(0.18, 0.14, angle) for angle in middle])
    for index, (name, colour, shift) in enumerate(
        (("inner wheel", COMMAND, 14), ("outer wheel", ESTIMATE, -18))
    ):
        draw.add(figure, [draw.curve(np.degrees(middle), both[:, index], colour)], 1, 2)
        figure.add_annotation(
            x=25, y=both[50, index], text=name, showarrow=False, font_color=colour, yshift=shift,
            xshift=-shift, row=1, col=2,
        )  # fmt: skip
    figure.update_xaxes(title_text="one wheel in the middle, degrees", row=1, col=2)
    figure.update_yaxes(title_text="front wheel, degrees", row=1, col=2)
    figure.update_layout(height=430)
    return draw.section(
        "An Ackermann turn",
        "The axes of both front wheels must meet the rear axle in one point, so the inner wheel turns "
        "further. Each wheel runs on its own radius, and at its own speed: driven by one stiff axle the "
        "rear wheels would skid. With the front wheel's speed v the yaw rate is v sin α / L; with the rear "
        "axle's it is v tan α / L.",
        cells(
            "np.degrees(formulas.ackermann_angles(wheelbase=0.18, track=0.14, steering=0.5404))",
            "icr(ready.ackermann(), np.array([0, 0, 0.3, 0.3])).kind   # parallel wheels: no motion",
        )
        + draw.picture(figure),
    )


def mecanum() -> str:
    robot = ready.mecanum()
    figure = make_subplots(1, 6, subplot_titles=list(DIRECTIONS), horizontal_spacing=0.01)
    for column, (x, y, turn) in enumerate(DIRECTIONS.values(), 1):
        signs = np.sign(wheels.inverse(robot, np.array([x, y, turn], dtype=float)).speeds)
        draw.add(figure, draw.robot_traces(robot, np.zeros(4)), 1, column)
        for number, (wheel, sign) in enumerate(zip(robot.wheels, signs, strict=True), 1):
            beside = wheel.position + np.array([0.0, 0.045 * np.sign(wheel.position[1])])
            way = np.array([0.035 * sign, 0.0])
            draw.arrow(figure, beside - way, beside + way, GOOD if sign > 0 else BAD, column)
            draw.add(figure, [draw.label(0.55 * wheel.position, str(number))], 1, column)
        arc = [(0.035 * math.cos(t * turn), 0.035 * math.sin(t * turn)) for t in np.linspace(-2.0, 2.0, 30)]
        way = np.array(arc) if turn else np.array([[0.0, 0.0], [0.06 * x, 0.06 * y]])
        draw.add(figure, [draw.outline(way, TRUTH, 2)], 1, column)
        draw.arrow(figure, way[-4 if turn else 0], way[-1], TRUTH, column)
    draw.seen_from_above(figure, (-0.16, 0.16), (-0.13, 0.13))
    figure.update_layout(height=230)
    return draw.section(
        "Mecanum wheels",
        "Green wheels turn forward, red ones backward; stripes are the rollers that touch the floor. Four "
        "wheels for three motions: speeds that contradict each other leave a residual (m/s), and the "
        "nearest motion.",
        draw.picture(figure)
        + cells(
            "inverse(ready.mecanum(), np.array([0.0, 0.1, 0.0])).speeds",
            "inverse(ready.mecanum(), np.array([0.0, 0.1, 0.0])).roller_speeds",
            "forward(ready.mecanum(), np.array([1.0, 1.0, 1.0, 2.0])).residual",
        ),
    )


def driving() -> str:
    titles = ["Paths", "Car: yaw rate, rad/s", "Car: front wheels, degrees"]
    widths = [0.42, 0.29, 0.29]
    figure = make_subplots(1, 3, column_widths=widths, horizontal_spacing=0.07, subplot_titles=titles)
    dt, period = 0.02, 2.0 * math.pi / 0.4
    for name, colour in (("differential", ESTIMATE), ("ackermann", COMMAND), ("two_steer", GOOD)):
        drive, pose, kept = wheels.WheelDrive(wheels.READY[name]()), np.zeros(3), []
        for tick in range(round(2 * period / dt)):
            wanted = np.array([0.12, 0.0, 0.4 if tick * dt < period else -0.4])
            state = drive.step(wanted, dt)
            pose = frames.moved(pose, state.twist, dt)
            kept.append([tick * dt, *pose[:2], wanted[2], state.twist[2], *np.degrees(state.steering[-2:])])
        data = np.array(kept)
        path = draw.outline(data[:, 1:3], colour, 2, name=name.replace("_", " "), showlegend=True)
        draw.add(figure, [path])
        if name == "ackermann":
            series = ((3, "wanted", NEUTRAL), (4, "reached", TRUTH), (5, "left wheel", LEG_COLOURS["FL"]))
            for column, title, tone in (*series, (6, "right wheel", COM)):
                draw.add(figure, [draw.curve(data[:, 0], data[:, column], tone, title)], 1, 2 + column // 5)
    draw.seen_from_above(figure, (-0.68, 0.68), (-0.36, 0.36), row=1, col=1)
    for column in (2, 3):
        figure.update_xaxes(title_text="s", range=[15.2, 17.0], row=1, col=column)
    figure.update_layout(height=330, showlegend=True, legend={"orientation": "h", "y": -0.18})
    return draw.section(
        "Motors lag, steering takes time",
        "A figure of eight with the same commands for each. Where steering is on its way the robot follows "
        "what its wheels permit at that moment: the part of the wanted twist in the null space of C1.",
        draw.picture(figure),
    )


def balancing() -> str:
    drive, rows = balance.BalancingDrive(seed=1), []
    for tick in range(1200):
        time = 0.01 * tick
        wanted = np.array([0.15 if 1 <= time < 7 else 0.0, 0.0, 0.6 if 4 <= time < 7 else 0.0])
        if tick == 950:
            drive.push(0.12)
        state = drive.step(wanted, 0.01)
        tilts = np.degrees([state.tilt, drive.estimate[2]])
        rows.append([time, *tilts, wanted[0], state.twist[0], wanted[2], state.twist[2]])
    data = np.array(rows)
    titles = ["Tilt, degrees, nose-down positive", "Speed, m/s", "Yaw rate, rad/s"]
    figure = make_subplots(1, 3, horizontal_spacing=0.06, subplot_titles=titles)
    series = ("true", TRUTH), ("Kalman filter's estimate", ESTIMATE), ("wanted", COMMAND)
    for column, which in enumerate((0, 1, 2, 0, 2, 0), 1):
        name, colour = series[which]
        trace = draw.curve(data[:, 0], data[:, column], colour, name, showlegend=column < 4)
        draw.add(figure, [trace], 1, (column + 1) // 2)
    for column in (1, 2):
        figure.add_vline(x=9.5, line={"color": BAD, "width": 1, "dash": "dot"}, row=1, col=column)
    figure.update_xaxes(title_text="s")
    figure.update_layout(height=300, showlegend=True, legend={"orientation": "h", "y": -0.25})
    return draw.section(
        "A robot that balances",
        "Two wheels, encoders, a gyro with a bias and an accelerometer. To drive ahead it must first roll "
        "back a little, to lean. A Kalman filter joins the sensors, a linear-quadratic regulator moves the "
        "wheels; at 9.5 s it is struck (0.12 N·s).",
        draw.picture(figure),
    )


def walking() -> str:
    shown = [gait for name, gait in gaits.GAITS.items() if name != "biped hop"]
    titles = [f"{gait.name}, {100 * gait.duty:.0f} %" for gait in shown]
    figure = make_subplots(3, 5, subplot_titles=titles, horizontal_spacing=0.035, vertical_spacing=0.13)
    for index, gait in enumerate(shown):
        for leg, name in enumerate(gait.legs):
            colour = LEG_COLOURS.get(name, ESTIMATE if name[0] in "lL" else COMMAND)
            bars = [
                {"type": "bar", "orientation": "h", "y": [name], "base": [start], "x": [end - start],
                 "marker": {"color": colour}, "width": 0.62}
                for start, end in gait.intervals(leg)
            ]  # fmt: skip
            draw.add(figure, bars, index // 5 + 1, index % 5 + 1)
    figure.update_yaxes(autorange="reversed", showgrid=False)
    figure.update_xaxes(range=[0, 1], tickvals=[0, 0.5, 1])
    figure.update_layout(height=500, barmode="overlay")
    return draw.section(
        "Legs",
        "Who stands when, over one cycle, with the share of it that each foot stands. Below, how far the "
        "centre of mass stays inside the feet on the floor: two feet never hold a trot, four legs can just "
        "crawl, six walk with margin.",
        f'{draw.picture(figure)}<div class="side"><div>{margins()}</div><div>{counts()}</div></div>',
    )


def margins() -> str:
    four = np.array([[0.165, 0.165], [0.165, -0.165], [-0.165, 0.165], [-0.165, -0.165]])
    six = np.array([[x, y] for y in (0.165, -0.165) for x in (0.2, 0.0, -0.2)])
    phase, figure = np.linspace(0.0, 1.0, 400), go.Figure()
    tones = {"trot": BAD, "walk": COMMAND, "crawl": GOOD, "tripod": ESTIMATE, "wave": COM}
    for name, colour in tones.items():
        gait = gaits.GAITS[name]
        margin = gaits.margin_over_cycle(gait, four if len(gait.legs) == 4 else six, 0.08, phase)
        figure.add_trace(draw.curve(phase, 1e3 * margin, colour, name))
    figure.update_layout(
        height=320, showlegend=True, yaxis_title="static margin, mm", xaxis_title="share of the cycle"
    )
    return draw.picture(figure)


def counts() -> str:
    feet = {
        number: "".join("●" if down else "○" for down in state) for number, state in legs.BIPED_STATES.items()
    }
    biped = [
        [f"{a} → {b} → {a}", f"{feet[a]} {feet[b]} {feet[a]}", sequence.name]
        for sequence in legs.biped_sequences()
        for a, b in [sequence.states]
    ]
    numbers = [[k, f"{legs.event_count(k):,}", f"{legs.alternative_count(k):,}"] for k in (2, 4, 6, 8)]
    head = ["legs", "(2k − 1)!", "2<sup>3(k − 1)</sup>"]
    return draw.table(["sequence", "left, right foot", "is"], biped) + draw.table(head, numbers)


def arm(q: Any) -> Any:
    """Hand of a planar arm of two links of 0.3 m."""
    return 0.3 * np.array([math.cos(q[0]) + math.cos(q[0] + q[1]), math.sin(q[0]) + math.sin(q[0] + q[1])])


def arm_jacobian(q: Any) -> Any:
    s, c = math.sin(q[0] + q[1]), math.cos(q[0] + q[1])
    return 0.3 * np.array([[-math.sin(q[0]) - s, -s], [math.cos(q[0]) + c, c]])


def equations() -> str:
    start = np.array([0.5, 1.6])
    points = arm(start) + np.linspace(0, 1, 26)[:, None] * (np.array([0.15, 0.7]) - arm(start))
    titles = ["A line that leaves the arm's reach", "Distance from the wanted point, m"]
    figure = make_subplots(1, 2, column_widths=[0.42, 0.58], horizontal_spacing=0.1, subplot_titles=titles)
    ring = 0.6 * np.array([(math.cos(t), math.sin(t)) for t in np.linspace(0.5, 2.2, 60)])
    draw.add(figure, [draw.curve(*ring.T, NEUTRAL, "reach"), draw.curve(*points.T, TRUTH, "wanted")])
    ways = (("pseudo-inverse", BAD, {}), ("damped", GOOD, {"method": "damped", "damping": 0.06}))
    for name, colour, options in ways:
        path = solving.follow(arm, arm_jacobian, points, start, **options)
        hand = np.array([arm(q) for q in path.q])
        style = {"mode": "lines+markers", "marker": {"size": 5}}
        draw.add(figure, [draw.curve(*hand.T, colour, name, **style)])
        draw.add(figure, [draw.curve(np.arange(len(points)), path.error, colour, **style)], 1, 2)
    figure.update_xaxes(scaleanchor="y", scaleratio=1, row=1, col=1)
    figure.update_xaxes(title_text="step", row=1, col=2)
    figure.update_layout(height=330, showlegend=True)
    return draw.section(
        "When the Jacobian has no inverse",
        "Where the arm is stretched, JᵀJ becomes singular and the pseudo-inverse asks for wild steps. "
        "Damping gives up a little accuracy and stays calm: (JᵀJ + λ²I) h = Jᵀ Δξ.",
        cells(
            "(A := np.array([[1.0, 2, 3], [2, 4, 6], [0, 1, 1]]))",
            "solving.least_squares(A, np.array([1.0, 2.0, 1.0])).explain()",
            "solving.null_space(A).ravel()",
        )
        + draw.picture(figure),
    )


if __name__ == "__main__":
    sys.exit(main())
