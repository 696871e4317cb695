"""The paper's section 4 as one function: from an RGB-D frame to the bodies of its people."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from threadpoolctl import ThreadpoolController

from pop_core.body.model import BodyModel
from pop_core.completion.joint_completion import JointCompletion, load_completion
from pop_core.config import PipelineConfig
from pop_core.depth_noise import DepthNoise, estimate_depth_noise
from pop_core.estimate import BodyEstimate, EstimateStatus, FrameResult
from pop_core.fitting.body_fit import BodyFit, BodyFitter
from pop_core.fitting.body_window import body_window
from pop_core.fitting.calibration import SINGLE_FRAME
from pop_core.fitting.joint_state import fitted_joint_states
from pop_core.fitting.observation import Observation, observe
from pop_core.fitting.plausibility import plausibility
from pop_core.fitting.uncertainty import Calibration, joint_covariance
from pop_core.geometry.camera import Camera
from pop_core.keypoints.detection import Detection, KeypointDetector
from pop_core.keypoints.joint_belief import JointBelief
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.keypoints.lifting import lift_keypoints
from pop_core.keypoints.region import is_inside
from pop_core.keypoints.undistortion import undistort_detection
from pop_core.rendering.depth_renderer import render_depth
from pop_core.retrieval.candidate import PoseCandidate
from pop_core.retrieval.outliers import reject_outliers, reject_strangers
from pop_core.retrieval.pose_library import PoseLibrary
from pop_core.retrieval.pose_prior import PosePrior, load_pose_prior
from pop_core.retrieval.retrieve import retrieve
from pop_core.rgbd import RgbdFrame, distort_mask, undistort_frame
from pop_core.segmentation.body_segmentation import segment_body, with_holes
from pop_core.segmentation.depth_support import depth_support
from pop_core.segmentation.ground import Ground, find_ground, ground_of
from pop_core.stopwatch import Stopwatch

SMALLEST_EXTENT_M = 0.15  # joints nearer together than this are no skeleton
DOUBTFUL_SCORE = 0.65  # a body that explains so little may be somebody seen from the other side
CLEARLY_LESS = 0.9  # of the cost as named, so that it is taken for that
SURER = 0.1  # by which the mean logarithm of sigmas is less, so that it is tried
MARGIN = 2.0  # around a body, of how far its segment may grow: a limb may be nearer than the rest
SAME_PLACE_M = 0.3  # a person behind another is often lifted onto the one in front


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A frame and what is already known of it when the next person is fitted.

    Args:
        frame: The undistorted frame.
        ground: The floor, if one is seen.
        noise: Noise of its depth.
        taken: Pixels that the people fitted so far explain.
    """

    frame: RgbdFrame
    ground: Ground | None
    noise: DepthNoise
    taken: Bool[np.ndarray, 'h w']

    def with_ground_of(
        self, p_camera: Float[np.ndarray, 'n 3'], sigma_m: Float[np.ndarray, 'n']
    ) -> Scene:
        """Return the scene with the floor only if somebody's joints are not below it."""
        return replace(self, ground=ground_of(self.ground, p_camera, sigma_m))


@dataclass(frozen=True, slots=True, eq=False)
class Reading:
    """What one person's keypoints are taken for.

    Args:
        detection: The keypoints as they are named.
        lifted: Joints lifted from them.
        expected: Where all joints are expected, or None where nothing is, or most that was
            lifted contradicts it.
    """

    detection: Detection
    lifted: LiftedJoints
    expected: JointBelief | None


@dataclass(frozen=True, slots=True, eq=False)
class PersonFit:
    """What became of one detection.

    Args:
        status: Why there is no body, or that there is one.
        estimate: The body as the pipeline's users get it.
        fit: The body as the fit left it.
        observation: What it was fitted to.
    """

    status: EstimateStatus
    estimate: BodyEstimate | None = None
    fit: BodyFit | None = None
    observation: Observation | None = None


class BodyPipeline:
    """Finds, fits and segments every person of a frame."""

    def __init__(
        self,
        model: BodyModel,
        library: PoseLibrary,
        detector: KeypointDetector,
        config: PipelineConfig | None = None,
        prior: PosePrior | None = None,
        completion: JointCompletion | None = None,
    ) -> None:
        """Prepare the pipeline for one body model, pose library and keypoint source.

        Args:
            model: Body to fit.
            library: Poses to begin with.
            detector: Finds people.
            config: Settings; None takes the defaults.
            prior: Pose prior; None takes the embedded one.
            completion: Says where hidden joints are, unless `use_completion` is off; None takes
                the embedded one.
        """
        self.model, self.library, self.detector = model, library, detector
        self.config = config or PipelineConfig()
        self.fitter = BodyFitter(
            model, prior or load_pose_prior(), self.config.fitting, self.config.segmentation)
        self.completion = completion
        if completion is None and self.config.use_completion:
            self.completion = load_completion()
        # Small products are slower on several BLAS threads than on one.
        self._blas = ThreadpoolController()

    def process(self, frame: RgbdFrame) -> FrameResult:
        """Return the bodies of a frame, nearest first (steps 1 to 8 of the paper).

        Raises:
            PopError: If the keypoint source cannot read what it needs for this frame, or a network
                fails.
        """
        watch = Stopwatch()
        with watch.step('detect'):
            detections = self.detector.detect(frame)
        with watch.step('undistort'):
            seen = undistort_frame(frame, colour=False)
            detections = [undistort_detection(d, frame.camera) for d in detections]
        with self._blas.limit(limits=1, user_api='blas'):
            bodies, statuses = self._fit_people(seen, detections, watch)
        bodies = [replace(b, mask=distort_mask(b.mask, frame.camera)) for b in bodies]
        return FrameResult(tuple(bodies), tuple(statuses), watch.times_ms)

    def _fit_people(
        self, frame: RgbdFrame, detections: Sequence[Detection], watch: Stopwatch
    ) -> tuple[list[BodyEstimate], list[EstimateStatus]]:
        """Fit one person after the other, nearest first, each an occluder of the next."""
        with watch.step('lift'):
            lifted = [self.lift(frame, detection) for detection in detections]
        distance_m = [joints.distance_m for joints in lifted]
        with watch.step('ground'):
            ground = find_ground(frame) if self.config.use_ground else None
            noise = estimate_depth_noise(frame.depth_m, frame.camera.fx)
        statuses = [self.admit(joints) for joints in lifted]
        scene = Scene(frame, ground, noise, np.zeros(frame.depth_m.shape, dtype=bool))
        bodies: list[BodyEstimate] = []
        nearer: BodyEstimate | None = None
        for i in nearest_first(distance_m, detections):
            if statuses[i] is not EstimateStatus.OK:
                continue
            if len(bodies) >= self.config.max_people:
                statuses[i] = EstimateStatus.TOO_MANY
                continue
            if nearer is not None:
                scene = self.behind(scene, nearer)
            person = self.fit_person(scene, detections[i], lifted[i], watch)
            statuses[i], nearer = person.status, person.estimate
            if nearer is not None:
                bodies.append(nearer)
        return bodies, statuses

    def behind(self, scene: Scene, nearer: BodyEstimate) -> Scene:
        """Return the scene as it is for whoever is farther than a fitted person.

        The person's pixels are taken. They hide what lies behind them, also where nothing was
        measured: there the fitted body's depth stands for the missing one.
        """
        frame = scene.frame
        holes = nearer.mask & np.isnan(frame.depth_m)
        if holes.any():
            body = self.fitter.full
            rendered = render_depth(
                nearer.vertices, body.faces, frame.camera, closed=body.is_closed)
            holes &= rendered.covered
            frame = replace(
                frame, depth_m=np.where(holes, rendered.depth_m, frame.depth_m))
        return replace(scene, frame=frame, taken=scene.taken | nearer.mask)

    def fit_person(
        self,
        scene: Scene,
        detection: Detection,
        lifted: LiftedJoints,
        watch: Stopwatch,
    ) -> PersonFit:
        """Fit one person; where that is in doubt, with left and right exchanged, too.

        A detector that takes a back for a front names every joint after the other side, and
        retrieval believes it. Depth tells: where it is surer of the joints once they are
        exchanged, or where the body explains little, the cheaper of both is taken.
        """
        with watch.step('complete'):
            named = self._expected(scene, detection)
        with watch.step('lift'):
            reading = self._read(scene, detection, named, lifted)
        # What is no floor of theirs is level all the same.
        gravity = None if scene.ground is None else -scene.ground.normal
        if reading.expected is not None:
            scene = scene.with_ground_of(
                reading.expected.positions_camera, reading.expected.sigma_m)
        person = self._fit_as_read(scene, reading, gravity, watch)
        turned = self._turned(scene, reading, named, person, watch)
        if turned is None:
            return person
        again = self._fit_as_read(scene, turned, gravity, watch)
        return again if self._costs_less(again, person) else person

    def _turned(
        self, scene: Scene, reading: Reading, named: JointBelief | None, person: PersonFit,
        watch: Stopwatch,
    ) -> Reading | None:
        """Return the reading with left and right exchanged, None where nothing speaks for it."""
        if not self.config.fitting.other_readings:
            return None
        other, exchanged = reading.detection.with_sides_exchanged(), None
        if named is not None:
            with watch.step('complete'):
                exchanged = self._expected(scene, other)
        explains_little = person.estimate is not None and person.estimate.score <= DOUBTFUL_SCORE
        if not (explains_little or is_surer(exchanged, named)):
            return None
        with watch.step('lift'):
            turned = self._read(scene, other, exchanged)
        # Joints that depth contradicts are gone: with fewer left, there is less to cost anything.
        return turned if turned.lifted.lifted.sum() >= reading.lifted.lifted.sum() else None

    def _costs_less(self, person: PersonFit, other: PersonFit) -> bool:
        """Return whether a fit explains a person at clearly less cost, each as it read it."""
        if person.fit is None or person.observation is None:
            return False
        if other.fit is None or other.observation is None:
            return True
        ours, theirs = self.fitter.costs(
            [person.fit, other.fit], [person.observation, other.observation])
        return ours < CLEARLY_LESS * theirs

    def _expected(self, scene: Scene, detection: Detection) -> JointBelief | None:
        if self.completion is None or not self.config.use_completion:
            return None
        return self.completion.expected(scene.frame, detection, scene.taken)

    def _read(
        self, scene: Scene, detection: Detection, expected: JointBelief | None,
        lifted: LiftedJoints | None = None,
    ) -> Reading:
        """Lift joints from what nearer people left, by where they are expected.

        Expected joints that most of those that were lifted contradict are somebody else's.
        """
        covered = covers_keypoints(scene.taken, detection)
        frame = without_depth(scene.frame, scene.taken) if covered else scene.frame
        if expected is not None:
            found = self.lift(frame, detection, expected)
            near = reject_strangers(found, expected)
            agree = 2 * near.lifted.sum() > found.lifted.sum()
            for joints in (near, found):
                if agree and self.admit(joints) is EstimateStatus.OK:
                    return Reading(detection, joints, expected)
        if lifted is None or covered:
            lifted = self.lift(frame, detection)
        return Reading(detection, lifted, None)

    def _fit_as_read(
        self, scene: Scene, reading: Reading, gravity: Float[np.ndarray, '3'] | None,
        watch: Stopwatch,
    ) -> PersonFit:
        """Retrieve, fit and segment one person."""
        lifted, expected = reading.lifted, reading.expected
        status = self.admit(lifted)
        if status is not EstimateStatus.OK:
            return PersonFit(status)
        with watch.step('observe'):
            observation = observe(
                scene.frame, lifted, scene.taken, scene.ground, reading.detection.part_labels,
                scene.noise, expected=expected)
        with watch.step('retrieve'):
            candidates = self._retrieve(lifted, observation, scene.frame.camera, gravity)
        if not candidates or candidates[0].residual_m > self.config.max_residual_m:
            return PersonFit(EstimateStatus.NO_SKELETON)
        with watch.step('fit'):
            fit = self.fitter.fit(observation, candidates)
        with watch.step('segment'):
            estimate, support = self.estimate(scene, fit, plausibility(fit, lifted))
        if support < self.config.min_support:
            return PersonFit(EstimateStatus.NO_SUPPORT)
        return PersonFit(EstimateStatus.OK, estimate, fit, observation)

    def lift(
        self, frame: RgbdFrame, detection: Detection, expected: JointBelief | None = None
    ) -> LiftedJoints:
        """Return the joints of a detection in 3D, without those that no pose explains."""
        lifted = lift_keypoints(frame, detection, self.config.lifting, expected)
        return reject_outliers(self.library, lifted, self.config.retrieval)

    def _retrieve(
        self, lifted: LiftedJoints, observation: Observation, camera: Camera,
        gravity: Float[np.ndarray, '3'] | None,
    ) -> Sequence[PoseCandidate]:
        def in_the_open_m(p_camera: Float[np.ndarray, 'n 3']) -> Float[np.ndarray, 'n']:
            """Return how far points stand in front of what the camera measured there."""
            gap = observation.depth_at(p_camera)[0] - p_camera[:, 2]
            open_m = np.where(np.isfinite(gap), np.maximum(gap, 0.0), 0.0)
            if observation.ground is None:
                return open_m
            # Nor can anything hide below the floor.
            return np.maximum(open_m, -observation.ground.height(p_camera))

        return retrieve(
            self.library, lifted, self.config.retrieval, hides=in_the_open_m, gravity=gravity,
            camera=camera, expected=observation.expected)

    def estimate(
        self, scene: Scene, fit: BodyFit, trust: float,
        calibration: Calibration = SINGLE_FRAME,
    ) -> tuple[BodyEstimate, float]:
        """Return the result of a fit at the frame's full resolution, and its depth support.

        Args:
            scene: The frame.
            fit: The body.
            trust: Share 0..1 that multiplies the support to the score.
            calibration: How wide covariances are, given what speaks against such a fit.
        """
        parameters, body = fit.parameters, self.fitter.full
        mesh = body.skinning.vertices(parameters, fit.coarse.skeleton)
        window = body_window(
            mesh, scene.frame.camera, margin_m=MARGIN * self.config.segmentation.growth_m)
        camera, depth_m = window.camera(scene.frame.camera), window.cut(scene.frame.depth_m)
        rendered = render_depth(mesh, body.faces, camera, closed=body.is_closed)
        free = ~window.cut(scene.taken)
        own = np.isfinite(depth_m) & free
        if scene.ground is not None:
            own &= ~scene.ground.floor_pixels(depth_m, camera)
        mask = np.zeros(scene.taken.shape, dtype=bool)
        segment = segment_body(
            depth_m, rendered, own, camera.fx, self.config.segmentation, scene.noise)
        window.view(mask)[:] = with_holes(segment, ~np.isfinite(depth_m) & free, rendered)
        joints = fit.coarse.joints
        state = fitted_joint_states(self.model, joints, rendered, depth_m, camera)
        support = depth_support(depth_m, rendered, own)
        covariance = joint_covariance(self.model, fit, state, calibration)
        estimate = BodyEstimate(
            parameters=parameters, vertices=mesh, joints=joints,
            joint_rotations=fit.coarse.skeleton.G, joint_state=state,
            joint_covariance=covariance, mask=mask, score=support * trust,
            energies=fit.energies, runners_up=fit.runners_up,
        )
        return estimate, support

    def admit(self, lifted: LiftedJoints) -> EstimateStatus:
        """Return OK for joints that a body can be fitted to, or why it cannot."""
        if int(lifted.lifted.sum()) < self.config.min_joints:
            return EstimateStatus.TOO_FEW_JOINTS
        if lifted.extent_m < SMALLEST_EXTENT_M:
            return EstimateStatus.NO_SKELETON
        if lifted.distance_m > self.config.max_range_m:
            return EstimateStatus.TOO_FAR
        if not is_inside(lifted, self.config.region):
            return EstimateStatus.OUTSIDE
        return EstimateStatus.OK


def is_surer(exchanged: JointBelief | None, named: JointBelief | None) -> bool:
    """Return whether more is known of a person's joints with left and right exchanged."""
    return (exchanged is not None and named is not None
            and exchanged.vagueness < named.vagueness - SURER)


def covers_keypoints(taken: Bool[np.ndarray, 'h w'], detection: Detection) -> bool:
    """Return whether a keypoint of a person lies on pixels that another person explains."""
    uv = detection.keypoints_px[np.isfinite(detection.keypoints_px).all(axis=1)]
    u, v = np.clip(np.rint(uv), 0, np.array(taken.shape[::-1]) - 1).astype(np.int64).T
    return bool(taken[v, u].any())


def without_depth(frame: RgbdFrame, taken: Bool[np.ndarray, 'h w']) -> RgbdFrame:
    """Return a frame with nothing measured at some pixels: nobody else is lifted onto them."""
    depth_m = frame.depth_m.copy()
    np.putmask(depth_m, taken, np.nan)
    return replace(frame, depth_m=depth_m)


def nearest_first(
    distance_m: Sequence[float], detections: Sequence[Detection]
) -> Int[np.ndarray, 'n']:
    """Return the order of people: nearest first, and of two in one place the better seen."""
    place = np.floor(np.minimum(distance_m, 1e6) / SAME_PLACE_M)
    return np.lexsort((-np.array([d.scores.sum() for d in detections]), place))
