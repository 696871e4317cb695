"""The tracker on synthetic recordings: numbers survive walls, and nobody is made up."""

from itertools import islice

from benchmarks.accuracy_methods import GivenDetections
from benchmarks.tracking_methods import Tracked, follow
from benchmarks.tracking_metrics import correspond, mot_scores
from pop_core.body.model import BodyModel
from pop_core.pipeline import BodyPipeline
from pop_core.retrieval.default_library import default_library
from pop_core.synthesis.sequence import SequenceConfig, film_sequence
from pop_core.synthesis.sequence_names import SequenceKind
from pop_core.tracking.tracking_config import TrackingConfig

RATE_HZ = 10.0


def scores_of(
    body: BodyModel, kind: str, n_frames: int, seed: int = 20_000, rate_hz: float = RATE_HZ,
    stop: int | None = None,
):
    """Return the truth of a recording, or of its first frames, and how it was followed."""
    detector = GivenDetections()
    tracked = Tracked(BodyPipeline(body, default_library(), detector), TrackingConfig())
    film = SequenceConfig(SequenceKind(kind), n_frames, rate_hz, colour=False)
    truth, tracks = follow(
        islice(film_sequence(body, seed, film), stop), rate_hz, {'tracked': tracked}, detector,
        lambda: None)
    table = tracks['tracked']
    return truth, mot_scores(truth, table, correspond(truth, table))


def test_a_person_keeps_the_number_behind_a_wall(body: BodyModel):
    truth, scores = scores_of(body, 'wall', 36)
    hidden = ~truth.required
    assert hidden.sum() / RATE_HZ > 1.0
    assert (scores.switches, scores.misses) == (0, 0)
    assert scores.extra <= 0.25 * hidden.sum()  # nobody knows where a hidden person turns


def test_the_wall_that_hides_a_person_is_not_taken_for_them(body: BodyModel):
    truth, scores = scores_of(body, 'wall', 60, seed=31_001, rate_hz=30.0, stop=15)
    assert not truth.required[-1]
    assert (scores.extra, scores.misses) == (0, 0)


def test_two_who_pass_each_other_keep_their_numbers(body: BodyModel):
    _, scores = scores_of(body, 'crossing', 24)
    assert scores.switches == 0
    assert scores.idf1 > 0.95
