"""Rows of the ablation: the paper's laws, and model-based control with its parts added one by one."""

from __future__ import annotations

from dataclasses import dataclass

from bluefoot_mpc.exceptions import UnknownNameError

NO_PREVIEW = ("control.sway.trot=static", "control.sway.walk=static")
NO_WHOLE_BODY = ("control.whole_body.enabled=false",)
NO_TORQUE = (
    "control.servo.mixing=0", "control.gait.trot_table.mixing=[]", "control.gait.walk_table.mixing=[]",
)  # fmt: skip
"""What switches a part off, wherever its share is stated: the tables of the gaits have the last word."""

LIFT = ("control.gait.walk_table.step_height=[0.02]",)
"""Without torque soft legs sag and the walk's low step would drag: it is that of the paper's laws again."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Variant:
    """A controller with parts of it switched off.

    Attributes:
        name: as tables and options call it.
        controller: what it is built from.
        overrides: ``section.key=value``, what switches parts off.
        meaning: one line for people.
    """

    name: str
    controller: str
    overrides: tuple[str, ...] = ()
    meaning: str


VARIANTS = (
    Variant(name="cpg", controller="cpg", meaning="the paper's laws"),
    Variant(
        name="timing", controller="mpc", overrides=(*NO_PREVIEW, *NO_WHOLE_BODY, *LIFT),
        meaning="gait tables, estimator and levelling of mpc, and the paper's sway",
    ),
    Variant(
        name="preview", controller="mpc", overrides=(*NO_WHOLE_BODY, *LIFT),
        meaning="timing and the ZMP preview",
    ),
    Variant(
        name="wbc", controller="mpc", overrides=(*NO_TORQUE, *LIFT),
        meaning="preview and the whole-body problem: speed fed forward, no torque",
    ),
    Variant(name="mpc", controller="mpc", meaning="wbc and torque fed forward: all of mpc"),
)  # fmt: skip
"""From the paper's laws to all of model-based control; the first is what the others are compared with."""


def variants(names: tuple[str, ...] = ()) -> tuple[Variant, ...]:
    """The variants of these names, all of them where none is given.

    Raises:
        UnknownNameError: there is no such variant.
    """
    known = {variant.name: variant for variant in VARIANTS}
    for name in names:
        if name not in known:
            raise UnknownNameError("variant", name, known)
    return tuple(known[name] for name in known if name in names or not names)
