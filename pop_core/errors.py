"""Exceptions of the package: every message states what was expected, found, and where."""


class PopError(Exception):
    """Base of every error the package raises on purpose."""


class FrameError(PopError):
    """A colour, depth or camera record that does not fit together."""


class RepeatedStampError(FrameError):
    """A frame of a sequence that is less than a millisecond after the one before."""


class CameraError(PopError):
    """Intrinsics or distortion that no projection can be computed from."""


class ModelFileError(PopError):
    """A body model file that is damaged, incomplete or not a body model."""


class UnsafeFileError(PopError):
    """A file that asks for code to be run while it is read."""


class LibraryFileError(PopError):
    """A pose library file that is damaged, incomplete or of another version."""


class KeypointFileError(PopError):
    """A keypoint file that does not hold people in the expected format."""


class DetectionError(PopError):
    """Keypoints of a source that are not those of a person, by number or shape."""


class NetworkShapeError(PopError):
    """A network whose inputs or outputs do not fit its decoder."""


class SettingError(PopError):
    """A setting outside its bounds, of the wrong type, or of an unknown name."""
