"""Settings of the fit."""

from __future__ import annotations

from dataclasses import dataclass

from pop_core.settings import setting


@dataclass(frozen=True, slots=True)
class FittingConfig:
    """How hypotheses are fitted and chosen."""

    surface_hypotheses: int = setting(
        6, minimum=1, maximum=12,
        about='Hypotheses that reach the surface fit, best of E_J3D first.')
    final_hypotheses: int = setting(
        3, minimum=1, maximum=12,
        about='Hypotheses that are fitted to the end, best of E_depth first.')
    limb_searches: int = setting(
        2, minimum=0, maximum=10,
        about='Times that limbs of the finalists are looked for beyond the retrieved poses.')
    limb_trials: int = setting(
        2, minimum=0, maximum=10,
        about='Other ways of each arm and leg that are fitted to compare them with the winner.')
    surface_points: int = setting(
        700, minimum=50, maximum=20000,
        about='Most measured points that pull on the body in one step.')
    polish_steps: int = setting(
        3, minimum=0, maximum=20,
        about='Steps of the winner on the full mesh.')
    prior_weight: float = setting(
        0.5, minimum=0.0, maximum=100.0,
        about='Weight of the learned pose prior.')
    neighbour_weight: float = setting(
        0.15, minimum=0.0, maximum=100.0,
        about='Weight of the conditional prior: stay near the retrieved pose where all agree.')
    collision_weight: float = setting(
        1.0, minimum=0.0, maximum=100.0,
        about='Weight of limbs that may not pass through the trunk or each other.')
    expected_weight: float = setting(
        0.5, minimum=0.0, maximum=100.0,
        about='Weight of where the completion network expects the joints.')
    other_readings: bool = setting(
        True,
        about='Whether bodies are tried turned about, legs exchanged, limbs rolled back, too.')
    seat_contact: bool = setting(
        False, about='Whether people who sit or lie rest on the seat measured beside them.')
    free_space: bool = setting(
        True, about='Whether bodies are pushed out of space the sensor saw through.')
