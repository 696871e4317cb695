"""The tracker on synthetic recordings: numbers survive walls, and nobody is made up."""

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


def scores_of(body: BodyModel, kind: str, n_frames: int):
    detector = GivenDetections()
    tracked = Tracked(BodyPipeline(body, default_library(), detector), TrackingConfig())
    film = SequenceConfig(SequenceKind(kind), n_frames, RATE_HZ, colour=False)
    truth, tracks = follow(
        film_sequence(body, 20_000, film), RATE_HZ, {'tracked': tracked}, detector, lambda: None)
    table = tracks['tracked']
    return truth, mot_scores(truth, table, correspond(truth, table))


def test_a_person_keeps_the_number_behind_a_wall(body: BodyModel):
    truth, scores = scores_of(body, 'wall', 36)
    hidden = ~truth.required
    assert hidden.sum() / RATE_HZ > 1.0
    assert (scores.switches, scores.misses) == (0, 0)
    assert scores.extra <= 0.25 * hidden.sum()  # nobody knows where a hidden person turns


def test_two_who_pass_each_other_keep_their_numbers(body: BodyModel):
    _, scores = scores_of(body, 'crossing', 24)
    assert scores.switches == 0
    assert scores.idf1 > 0.95
