import numpy as np
import pytest

from pop_core.body.default_body import default_body
from pop_core.body.joints import SHARED_INDEX
from pop_core.body.kinematics import attached_positions
from pop_core.body.model import BodyParameters, shared_points
from pop_core.errors import LibraryFileError
from pop_core.geometry.camera import Camera
from pop_core.geometry.rotation import from_rotvec, to_rotvec
from pop_core.keypoints.joint_belief import JointBelief
from pop_core.keypoints.lifted_joints import LiftedJoints, LiftState
from pop_core.retrieval.default_library import generate_library
from pop_core.retrieval.outliers import reject_strangers
from pop_core.retrieval.pose_library import PoseLibrary, build_library, visibility_mask
from pop_core.retrieval.retrieve import RetrievalConfig, choose_diverse, completed, retrieve

UPRIGHT = from_rotvec(np.array([np.pi, 0.0, 0.0]))
ARM = [SHARED_INDEX['left_elbow'], SHARED_INDEX['left_wrist']]
LEGS = [SHARED_INDEX[f'{side}_{name}'] for side in ('left', 'right') for name in ('knee', 'ankle')]


@pytest.fixture(scope='module')
def library() -> PoseLibrary:
    return generate_library(default_body(), 4000, seed=1)


def seen_from(joints: np.ndarray, hidden: list[int] = []) -> LiftedJoints:  # noqa: B006
    positions, sigma = joints.copy(), np.full(15, 0.02)
    state = np.full(15, int(LiftState.VISIBLE))
    positions[hidden], sigma[hidden], state[hidden] = np.nan, np.inf, int(LiftState.MISSING)
    return LiftedJoints(positions, sigma, state, np.full((15, 2), np.nan), np.ones(15))


def placed(library: PoseLibrary, row: int, scale: float = 0.95, yaw: float = 0.7) -> np.ndarray:
    R = UPRIGHT @ from_rotvec(np.array([0.0, yaw, 0.0]))
    return scale * library.joints[row].astype(float) @ R.T + [0.2, 0.1, 3.0]


def test_a_pose_of_the_library_finds_itself(library):
    for row in (3, 700, 3999):
        joints = placed(library, row)
        # Any size is as likely as another here.
        best = retrieve(library, seen_from(joints), RetrievalConfig(scale_sigma=10.0))[0]
        assert best.index == row
        assert best.residual_m < 1e-3
        assert np.allclose(best.joints_camera, joints, atol=1e-3)
        assert np.isclose(best.scale, 0.95, atol=1e-3)


def test_few_noisy_joints_leave_a_person_near_usual_size(library):
    joints = placed(library, 42, scale=0.7)
    few = [j for j in range(15) if SHARED_INDEX['neck'] != j and j not in LEGS[:2]]
    many, told = (
        retrieve(library, seen_from(joints, hidden))[0].scale for hidden in ([], few))
    assert 0.69 < many < 0.76
    assert many < told <= 1.0


def test_hidden_joints_are_looked_for_where_they_are_expected(library):
    joints, other = placed(library, 42), placed(library, 700)
    joints[LEGS] = joints[0] + other[LEGS] - other[0]
    lifted = seen_from(joints, LEGS)
    alone = retrieve(library, lifted)[0]
    expected = JointBelief(joints + 0.02, np.where(np.isin(np.arange(15), LEGS), 0.1, 0.05))
    told = retrieve(library, lifted, expected=expected)[0]
    off_m = [np.linalg.norm((found.joints_camera - joints)[LEGS], axis=1).mean()
             for found in (alone, told)]
    assert off_m[1] < 0.6 * off_m[0]


def test_lifting_and_what_is_expected_count_by_their_spread(library):
    joints = placed(library, 42)
    lifted = seen_from(joints, LEGS)
    expected = JointBelief(joints + [0.03, 0.0, 0.0], np.full(15, 0.04))
    known = completed(lifted, expected)
    assert known.lifted.all()
    sure = [j for j in range(15) if j not in LEGS]
    assert np.allclose((known.positions_camera - joints)[sure, 0], 0.03 / 5)
    assert np.allclose(known.sigma_m[sure], (1 / 0.02**2 + 1 / 0.04**2) ** -0.5)
    assert np.allclose(known.positions_camera[LEGS], expected.positions_camera[LEGS])
    assert np.allclose(known.sigma_m[LEGS], 0.04)
    assert completed(lifted, None) is lifted


def test_a_joint_far_from_where_it_is_expected_is_a_stranger(library):
    joints = placed(library, 42)
    lifted = seen_from(joints, LEGS)
    expected = JointBelief(joints.copy(), np.full(15, 0.04))
    expected.positions_camera[ARM] += [[0.1, 0.0, 0.0], [0.5, 0.0, 0.0]]
    told = reject_strangers(lifted, expected)
    assert told.state[ARM[1]] == LiftState.OUTLIER
    assert not told.lifted[ARM[1]]
    assert told.scores[ARM[1]] < lifted.scores[ARM[1]]
    others = np.delete(np.arange(15), ARM[1])
    assert (told.lifted[others] == lifted.lifted[others]).all()
    expected.sigma_m[ARM[1]] = 0.4  # nothing is known of it
    assert reject_strangers(lifted, expected).lifted[ARM[1]]
    assert reject_strangers(lifted, None) is lifted


def test_candidate_is_the_body_that_its_parameters_pose(library):
    model = default_body()
    candidate = retrieve(library, seen_from(placed(library, 42), ARM))[1]
    posed = attached_positions(shared_points(model), model, BodyParameters(
        np.zeros(3), to_rotvec(candidate.R_camera_body), candidate.body_pose, np.zeros(10)))
    found = candidate.scale * (posed - model.joint_template[0]) + candidate.t_camera_body
    assert np.allclose(found, candidate.joints_camera, atol=1e-4)


def test_all_joints_but_a_hidden_arm_still_find_the_pose(library):
    indices = [c.index for c in retrieve(library, seen_from(placed(library, 1234), ARM))]
    assert indices[0] == 1234


def test_candidates_differ_where_nothing_was_seen(library):
    candidates = retrieve(library, seen_from(placed(library, 55), LEGS))
    legs = np.stack([c.joints_camera[LEGS] for c in candidates])
    gaps = np.linalg.norm(legs[:, None] - legs[None], axis=3).mean(axis=2)
    assert len(candidates) == 6
    assert gaps[~np.eye(6, dtype=bool)].min() > 0.05


def test_belief_sums_to_one_and_falls(library):
    weights = [c.weight for c in retrieve(library, seen_from(placed(library, 9), LEGS))]
    assert np.isclose(sum(weights), 1.0)
    assert weights == sorted(weights, reverse=True)


def test_a_scene_that_cannot_hide_legs_rules_them_out(library):
    joints = placed(library, 2000, yaw=0.0)

    def hides(points: np.ndarray) -> np.ndarray:
        """Only within 5 cm of the true legs can anything hide."""
        gap = np.linalg.norm(points[:, None] - joints[LEGS], axis=2).min(axis=1)
        return np.maximum(gap - 0.05, 0.0)

    config = RetrievalConfig(shortlist=1000)
    noisy = joints + np.random.default_rng(0).normal(size=joints.shape) * 0.02

    def error(candidate) -> float:
        return float(np.linalg.norm(candidate.joints_camera - joints, axis=1)[LEGS].mean())

    blind = retrieve(library, seen_from(noisy, LEGS), config)
    told = retrieve(library, seen_from(noisy, LEGS), config, hides=hides)
    assert error(told[0]) <= min(error(c) for c in blind)
    assert error(told[0]) < 0.15


def test_rays_of_pixels_without_depth_pull_hidden_joints(library):
    camera = Camera(640, 480, 525.0, 525.0, 319.5, 239.5)
    others = library.subset(np.arange(30, len(library)))
    gains = []
    for row in range(30):
        joints = placed(library, row)
        lifted = seen_from(joints, ARM)
        lifted = LiftedJoints(
            lifted.positions_camera, lifted.sigma_m, lifted.state, camera.project(joints),
            lifted.scores)
        errors = [
            np.linalg.norm(found[0].joints_camera - joints, axis=1)[ARM].mean()
            for found in (retrieve(others, lifted), retrieve(others, lifted, camera=camera))
        ]
        gains.append(errors[0] - errors[1])
    assert np.mean(gains) > 0.05


def test_gravity_keeps_people_upright(library):
    joints = placed(library, 321)
    fallen = (joints - joints[0]) @ from_rotvec(np.array([0.0, 0.0, 1.3])).T + joints[0]
    down = np.array([0.0, 1.0, 0.0])
    free = retrieve(library, seen_from(fallen))[0]
    strict = RetrievalConfig(lean_sigma_deg=0.0)
    held = retrieve(library, seen_from(fallen), strict, gravity=down)
    assert free.index == 321
    for candidate in held:
        tilt = from_rotvec(library.tilt[candidate.index].astype(float))
        up = candidate.R_camera_body @ tilt.T @ [0.0, 1.0, 0.0]
        assert np.allclose(up, -down, atol=1e-6)
    assert retrieve(library, seen_from(joints), gravity=down)[0].index == 321


def test_known_gravity_forgives_a_small_lean(library):
    joints = placed(library, 88)
    R = from_rotvec(np.array([0.0, 0.0, 0.15]))
    leaned = (joints - joints[0]) @ R.T + joints[0]
    assert retrieve(library, seen_from(leaned), gravity=np.array([0.0, 1.0, 0.0]))[0].index == 88


def test_known_gravity_decides_what_a_trunk_alone_leaves_open(library):
    down = np.array([0.0, 1.0, 0.0])
    trunk = {'pelvis', 'neck', 'left_shoulder', 'right_shoulder', 'left_hip', 'right_hip'}
    hidden = [row for name, row in SHARED_INDEX.items() if name not in trunk]

    def leans(candidates: list) -> np.ndarray:
        tilts = [from_rotvec(library.tilt[c.index].astype(float)) for c in candidates]
        up = np.stack([c.R_camera_body @ T.T for c, T in zip(candidates, tilts, strict=True)])
        return np.arccos(np.clip(up[:, :, 1] @ -down, -1.0, 1.0))

    free, held = [], []
    for row in range(0, 4000, 400):
        lifted = seen_from(placed(library, row), hidden)
        free.append(leans(retrieve(library, lifted)).mean())
        held.append(leans(retrieve(library, lifted, gravity=down)).mean())
    assert np.mean(held) < 0.15
    assert np.mean(free) > 2 * np.mean(held)


def test_two_joints_are_not_enough(library):
    joints = placed(library, 0)
    assert retrieve(library, seen_from(joints, list(range(2, 15)))) == []


def test_same_visibility_keeps_to_poses_recorded_alike(library):
    masks = np.full(len(library), visibility_mask(np.ones(15, dtype=bool)), dtype=np.uint16)
    seen = np.ones(15, dtype=bool)
    seen[ARM] = False
    alike = np.arange(0, len(library), 7)
    masks[alike] = visibility_mask(seen)
    recorded = PoseLibrary(
        library.body_pose, library.tilt, library.columns, masks, library.weights)
    config = RetrievalConfig(same_visibility=True)
    joints = placed(library, 8)
    for expected in (None, JointBelief(joints, np.full(15, 0.05))):
        found = retrieve(recorded, seen_from(joints, ARM), config, expected=expected)
        assert len(found) == 6
        assert all(candidate.index in alike for candidate in found)


def test_chosen_poses_stand_for_the_camps_of_belief():
    """Three camps a metre apart: one pose of each is chosen, with the belief of its camp."""
    rng = np.random.default_rng(0)
    camp = np.repeat([0, 1, 2], [50, 30, 20])
    joints = rng.normal(size=(100, 15, 3)) * 0.01
    joints[:, :, 0] += camp[:, None]
    chosen, share = choose_diverse(
        joints, np.zeros(100), np.zeros(15, dtype=bool), RetrievalConfig(candidates=3))
    assert sorted(camp[chosen].tolist()) == [0, 1, 2]
    assert np.allclose(share[np.argsort(camp[chosen])], [0.5, 0.3, 0.2])


@pytest.mark.parametrize('spread', [
    (0.0, 0.0, 0.0), (1e-4, 1e-4, 1e-4), (1.0, 0.0, 0.0), (2.0, 2.0, 2.0), (50.0, 50.0, 50.0)])
@pytest.mark.parametrize('gravity', [None, (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
def test_joints_that_are_no_person_get_finite_answers(library, spread, gravity):
    """A point, a line, noise, or things fifty metres apart: a detector may say anything."""
    rng = np.random.default_rng(3)
    down = None if gravity is None else np.array(gravity)
    for seen in (3, 8, 15):
        joints = rng.normal(size=(15, 3)) * np.array(spread) + [0.0, 0.0, 3.0]
        hidden = rng.choice(15, 15 - seen, replace=False).tolist()
        for c in retrieve(library, seen_from(joints, hidden), gravity=down):
            assert np.isfinite(c.joints_camera).all()
            assert np.isclose(np.linalg.det(c.R_camera_body), 1.0)
            assert 0.5 <= c.scale <= 1.25
            assert 0.0 <= c.weight <= 1.0


def test_no_pose_is_chosen_twice_even_where_one_has_all_the_belief():
    energy = np.full(40, 1e6)
    energy[5] = 0.0
    chosen, share = choose_diverse(
        np.zeros((40, 15, 3)), energy, np.zeros(15, dtype=bool), RetrievalConfig())
    assert chosen[0] == 5
    assert len(set(chosen.tolist())) == 6
    assert np.isclose(share.sum(), 1.0)


def test_of_poses_that_agree_the_best_is_chosen():
    rng = np.random.default_rng(1)
    energy = rng.uniform(1, 9, 60)
    energy[17] = 0.5
    joints = np.zeros((60, 15, 3)) + rng.normal(size=(60, 1, 1)) * 1e-4
    chosen, _ = choose_diverse(
        joints, energy, np.zeros(15, dtype=bool), RetrievalConfig(candidates=1))
    assert chosen[0] == 17


def test_a_single_answer_stands_among_its_like_and_not_with_a_lucky_stranger():
    """Forty poses agree on the hidden joints; one fits a little better and does not."""
    rng = np.random.default_rng(2)
    joints = rng.normal(size=(41, 15, 3)) * 0.01
    joints[40] += 0.5
    energy = np.full(41, 2.0)
    energy[40] = 1.0
    chosen, _ = choose_diverse(
        joints, energy, np.ones(15, dtype=bool), RetrievalConfig(candidates=1))
    assert chosen[0] != 40


def test_an_empty_library_is_refused():
    with pytest.raises(LibraryFileError, match='> 0'):
        build_library(np.zeros((0, 23, 3)), default_body())
