"""How people move between frames: velocities that fade, and how far they can change.

Each coordinate is an integrated Ornstein-Uhlenbeck process (Singer 1970): its velocity has a
standard deviation s and forgets itself with a time constant tau. A limb nobody sees goes on for a
moment, then stays, and its variance grows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pop_core.body.joints import JOINT_INDEX, N_JOINTS
from pop_core.fitting.body_state import GLOBAL_ORIENT, TRANSL

N_MOVING = 3 + 3 * N_JOINTS
# (standard deviation of the velocity [m/s, rad/s], how long it lasts [s])
WALK, RISE = (1.0, 1.0), (0.6, 0.3)  # along the floor, up and down
TURN = (1.5, 0.5)
TRUNK = (0.7, 0.3)
LIMB = (2.5, 0.25)
TIP = (1.0, 0.2)  # hands and feet hang on their limbs and are small in the image
OF_JOINT = {
    'hip': LIMB, 'knee': LIMB, 'shoulder': LIMB, 'elbow': LIMB, 'head': TURN,
    'wrist': TIP, 'ankle': TIP, 'hand': TIP, 'foot': TIP,
}
# Random walk of betas and log scale [1/sqrt(s)]: a shape stays, but a fit of one frame errs in
# the same way as the next, so that a second of frames is no proof.
BETA_DRIFT, SCALE_DRIFT = 0.15, 0.006


@dataclass(frozen=True, slots=True, eq=False)
class MotionNoise:
    """What a time step does to one coordinate and its velocity, and the variance it adds.

    Args:
        reach_s: Seconds that a velocity goes on for: its position gains velocity times this.
        decay: Share of a velocity that is left.
        position: Variance added to positions [m^2, rad^2].
        mixed: Covariance added between positions and velocities.
        velocity: Variance added to velocities.
    """

    reach_s: Float[np.ndarray, '75']
    decay: Float[np.ndarray, '75']
    position: Float[np.ndarray, '75']
    mixed: Float[np.ndarray, '75']
    velocity: Float[np.ndarray, '75']


def _of_coordinates() -> tuple[Float[np.ndarray, '75'], Float[np.ndarray, '75']]:
    """Return speeds and time constants of translation and all rotation increments."""
    table = np.empty((N_MOVING, 2))
    table[TRANSL], table[GLOBAL_ORIENT] = WALK, TURN
    table[1] = RISE  # y of a camera that looks ahead
    for name, j in JOINT_INDEX.items():
        if name != 'pelvis':
            table[3 + 3 * j: 6 + 3 * j] = OF_JOINT.get(name.split('_')[-1], TRUNK)
    return table[:, 0].copy(), table[:, 1].copy()


SPEED, LASTING_S = _of_coordinates()


def motion_noise(
    dt_s: float, liveliness: Float[np.ndarray, '75'] | float = 1.0
) -> MotionNoise:
    """Return the exact discretisation of the process over a time step [s].

    Args:
        dt_s: Time step.
        liveliness: Share of the usual standard deviation of each velocity.
    """
    decay = np.exp(-dt_s / LASTING_S)
    lost = 1.0 - decay
    density = 2.0 * (liveliness * SPEED) ** 2 / LASTING_S
    squared = LASTING_S * (1.0 - decay**2) / 2.0
    return MotionNoise(
        reach_s=LASTING_S * lost,
        decay=decay,
        position=np.maximum(
            density * LASTING_S**2 * (dt_s - 2.0 * LASTING_S * lost + squared), 0.0),
        mixed=density * LASTING_S**2 * lost**2 / 2.0,
        velocity=density * squared,
    )
