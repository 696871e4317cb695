"""Keypoints for `pop fit`: each frame's own file, or one network for all frames."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pop_ros.keypoint_sources import SOURCES, SourceError, keep_people, make_detector

if TYPE_CHECKING:
    from pop_core.keypoints.detection import Detection, KeypointDetector
    from pop_core.keypoints.people_selection import PeopleConfig
    from pop_core.rgbd import RgbdFrame
    from pop_ros.frame_folder import FrameFolder


class FrameKeypoints:
    """A keypoint source that is told which folder the next frame comes from."""

    def __init__(
        self, source: str | None, decoder: str | None, people: PeopleConfig | None = None
    ) -> None:
        """Take what the user said; None means each frame's file.

        Raises:
            PopError: If a named source does not exist or fits no decoder.
        """
        self._network: KeypointDetector | None = None
        if source not in (None, 'json'):
            self._network = make_detector(str(source), decoder=decoder)
            if people is not None:
                keep_people(self._network, people)
        self._current: KeypointDetector | None = None

    def choose(self, folder: FrameFolder) -> None:
        """Prepare for the frame of a folder.

        Raises:
            SourceError: If keypoints are to come from the folder and it has none.
            KeypointFileError: If its file is damaged.
        """
        from pop_core.keypoints.openpose_json import FileDetector

        if self._network is not None:
            self._current = self._network
        elif folder.keypoints.is_file():
            self._current = FileDetector(folder.keypoints)
        else:
            raise SourceError(
                f'{folder.path}: expected keypoints.json, or --keypoints with {SOURCES}, '
                'found neither')

    def detect(self, frame: RgbdFrame) -> list[Detection]:
        """Return the people of the chosen folder's frame."""
        assert self._current is not None
        return self._current.detect(frame)
