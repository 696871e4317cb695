"""Settings of the tracker."""

from __future__ import annotations

from dataclasses import dataclass

from pop_core.settings import setting


@dataclass(frozen=True, slots=True)
class TrackingConfig:
    """How people are followed from frame to frame."""

    enabled: bool = setting(
        True, about='Whether people are followed over time; else each frame stands alone.')
    detect_every: int = setting(
        3, minimum=1, maximum=1000,
        about='Frames from one look for people to the next while all are followed well, or nobody '
        'is there, at 30 Hz; as much time at other rates.')
    steps: int = setting(
        2, minimum=1, maximum=20,
        about='Steps of the fit from the predicted body.')
    prior_weight: float = setting(
        1.0, minimum=0.0, maximum=100.0,
        about='Weight of the learned pose prior on people who are followed; 1 is the prior as it '
        'was learned.')
    gate_m: float = setting(
        0.35, unit='m', minimum=0.05, maximum=3.0,
        about='Farthest that detected joints may lie from predicted ones, beside the doubt of '
        'the prediction.')
    confirm_frames: int = setting(
        3, minimum=1, maximum=100,
        about='Frames a person must be seen in before the track counts as sure.')
    predicted_s: float = setting(
        1.0, unit='s', minimum=0.0, maximum=60.0,
        about='How long a fully hidden person is still given out, where they should be by now.')
    lost_s: float = setting(
        3.0, unit='s', minimum=0.0, maximum=600.0,
        about='How long a person who is not seen keeps the id.')
    undecided_s: float = setting(
        1.0, unit='s', minimum=0.0, maximum=10.0,
        about='How long other explanations of a person are followed beside the best.')
    hypotheses: int = setting(
        2, minimum=1, maximum=3,
        about='Most explanations of one person that are followed while undecided.')
    smoothing: float = setting(
        0.0, minimum=0.0, maximum=0.99,
        about='Share of the last body in each body given out: steadier, but late; 0 is off.')
