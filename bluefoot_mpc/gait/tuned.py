"""Gait parameters over speed that were found in simulation.

The search (``benchmarks/tune_gait.py``, 40 to 50 trials a speed) ran on
randomised robots, with seeds that no reported figure uses; the trot was then
finished by hand, with paired seeds, and the walk's two columns were chosen among
some thirty variants. Cycle times are whole numbers of command ticks for each of
a trot's two turns (0.32 and 0.28 s at 50 Hz), with a short way between them: in
other cycles ticks and steps beat, and the trunk tilts up to twice as much. The
servos' feed-forward of speed fades as the swing becomes limited by voltage.
"""

from __future__ import annotations

from bluefoot_mpc.gait.table import GaitTable

TROT = GaitTable(
    speed=(0.06, 0.10, 0.14, 0.16, 0.20, 0.30, 0.40),
    cycle_time=(0.32, 0.32, 0.32, 0.28, 0.28, 0.28, 0.28),
    swing_share=(0.29, 0.29, 0.295, 0.30, 0.31, 0.31, 0.34),
    step_height=(0.0182, 0.0186, 0.0182, 0.0179, 0.0174, 0.0187, 0.0195),
    swing_rate=(6.8, 6.8, 7.1, 7.4, 7.8, 8.0, 8.0),
    law=("virtual_force",),
    vertical=("sine",),
    stance_x=(0.158, 0.158, 0.157, 0.155, 0.153, 0.152, 0.157),
    stance_y=(0.156, 0.156, 0.159, 0.162, 0.166, 0.167, 0.171),
    trunk_height=(0.110, 0.110, 0.106, 0.103, 0.0985, 0.0965, 0.0965),
    trunk_forward=(0.004, 0.004, 0.004, 0.0035, 0.003, 0.003, 0.003),
    level_gain=(0.3,),
    mixing=(0.3, 0.3, 0.35, 0.35, 0.4, 0.45, 0.5),
    back_emf=(0.4, 0.4, 0.3, 0.25, 0.2, 0.1, 0.0),
)
"""The trot of the model-based controller."""

WALK = GaitTable(speed=(0.03,), step_height=(0.014,), mixing=(0.9,), back_emf=(0.5,))
"""The walk of the model-based controller; what is not here follows the gait's own laws."""

ROUGH = GaitTable(speed=(0.03,), trunk_height=(0.118,), mixing=(0.6,), back_emf=(1.0,))
"""The walk over rough ground: slower cycles (`GaitConfig.rough`), a higher trunk."""

LEG_LENGTH = 0.26
"""m, of the robot that the tables were found for; see `GaitTable.scaled`."""
