"""Keypoints for `pop fit`: each frame's own file, networks for all frames, or both merged.

Where nothing is named and a frame has no file, the embedded network looks at its depth.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from pop_ros.keypoint_sources import SOURCES, SourceError, apply_settings, make_detector, reasons

if TYPE_CHECKING:
    from pop_core.config import PipelineConfig
    from pop_core.keypoints.detection import Detection, KeypointDetector
    from pop_core.rgbd import RgbdFrame
    from pop_ros.frame_folder import FrameFolder


class FrameKeypoints:
    """A keypoint source that is told which folder the next frame comes from."""

    def __init__(
        self, source: str | None, decoder: str | None, config: PipelineConfig | None = None
    ) -> None:
        """Take what the user said; None means each frame's file, or the embedded network.

        Raises:
            PopError: If a named source does not exist or fits no decoder.
        """
        self._file = _FolderFile(config, or_depth=source is None)
        self._source: KeypointDetector = self._file
        if source is not None:
            self._source = make_detector(source, decoder=decoder, json_source=self._file)
            if config is not None:
                apply_settings(self._source, config)

    @property
    def reasons(self) -> list[str]:
        """Return a sentence about each network: how it is read, and why so."""
        return reasons(self._source)

    def choose(self, folder: FrameFolder) -> None:
        """Prepare for the frame of a folder."""
        self._file.folder = folder

    def detect(self, frame: RgbdFrame) -> list[Detection]:
        """Return the people of the chosen folder's frame.

        Raises:
            SourceError: If keypoints are to come from the folder and it has none.
            PopError: If a source cannot read what it needs.
        """
        return self._source.detect(frame)


class _FolderFile:
    """People of the file that lies beside a frame; of its depth, if allowed, where none does."""

    def __init__(self, config: PipelineConfig | None, *, or_depth: bool) -> None:
        self.folder: FrameFolder | None = None
        self._config, self._or_depth = config, or_depth
        self._depth: KeypointDetector | None = None

    def detect(self, frame: RgbdFrame) -> list[Detection]:
        from pop_core.keypoints.openpose_json import FileDetector

        assert self.folder is not None
        if self.folder.keypoints.is_file():
            return FileDetector(self.folder.keypoints).detect(frame)
        if not self._or_depth:
            raise SourceError(
                f'{self.folder.path}: expected keypoints.json, or other --keypoints ({SOURCES}), '
                'found neither')
        if self._depth is None:
            try:
                self._depth = make_detector('depth')
            except SourceError as error:
                raise SourceError(f'{self.folder.path}: no keypoints.json; {error}') from None
            if self._config is not None:
                apply_settings(self._depth, self._config)
        return self._depth.detect(frame)
