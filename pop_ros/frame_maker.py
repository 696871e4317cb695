"""From the messages of one frame to an RgbdFrame, registering depth where it has its own frame."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float

from pop_core.errors import FrameError
from pop_core.geometry.camera import Camera
from pop_core.rendering.depth_registration import DepthRegistration
from pop_core.rgbd import RgbdFrame
from pop_ros.from_messages import (
    camera_from_info,
    decode_color,
    decode_depth,
    frame_from_messages,
    stamp_ns,
)
from pop_ros.message_error import BadMessageError
from pop_ros.static_frames import StaticFrames


class FrameMaker:
    """Makes frames, and keeps what registration needs from one frame to the next."""

    def __init__(self, frames: StaticFrames) -> None:
        """Take known transforms from `frames`, which may grow later."""
        self.extrinsics: Float[np.ndarray, '4 4'] | None = None
        self.is_rectified = False
        self.quarter_turns = 0
        self._frames = frames
        self._registration: DepthRegistration | None = None

    def make(self, color: Any, depth: Any, info: Any, depth_info: Any = None) -> RgbdFrame:
        """Return the frame of a pair of images, its camera told how it is mounted.

        Depth whose frame is that of colour is taken as registered. Any other depth is registered
        with `depth_info` and the transform given or known, and refused without them.

        Raises:
            BadMessageError: If a message cannot be read, or registration lacks something.
        """
        frame = self._registered(color, depth, info, depth_info)
        return replace(frame, camera=replace(frame.camera, quarter_turns=self.quarter_turns))

    def _registered(self, color: Any, depth: Any, info: Any, depth_info: Any) -> RgbdFrame:
        color_frame, depth_frame = color.header.frame_id, depth.header.frame_id
        if color_frame == depth_frame:
            return frame_from_messages(color, depth, info, is_rectified=self.is_rectified)
        T_color_depth = self.extrinsics
        if T_color_depth is None:
            T_color_depth = self._frames.lookup(color_frame, depth_frame)
        if T_color_depth is None:
            raise BadMessageError(
                f'pair: expected depth registered to color frame {color_frame!r}, found depth in '
                f'frame {depth_frame!r} and no transform between them: switch on depth '
                'registration (align_depth, depth_registered) in the driver, publish the '
                'transform on /tf_static, or set depth.extrinsics')
        if depth_info is None:
            raise BadMessageError(
                f'pair: expected depth/camera_info to register depth of frame {depth_frame!r} to '
                f'color frame {color_frame!r}, found none')
        color_camera = camera_from_info(info, is_rectified=self.is_rectified)
        registration = self._prepared(camera_from_info(depth_info), color_camera, T_color_depth)
        try:
            depth_m = registration.apply(decode_depth(depth))
            return RgbdFrame(decode_color(color), depth_m, color_camera, stamp_ns(color.header))
        except FrameError as error:
            raise BadMessageError(f'pair: {error}') from error

    def _prepared(
        self, depth_camera: Camera, color_camera: Camera, T_color_depth: Float[np.ndarray, '4 4']
    ) -> DepthRegistration:
        """Return the registration of these cameras; its rays are computed once."""
        known = self._registration
        if known is None or not (
            known.depth_camera.sees_like(depth_camera)
            and known.color_camera.sees_like(color_camera)
            and np.array_equal(known.T_color_depth, T_color_depth)
        ):
            known = DepthRegistration(depth_camera, color_camera, T_color_depth)
            self._registration = known
        return known
