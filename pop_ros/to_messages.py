"""Turn estimates into standard messages: Marker, PoseArray and PointCloud2.

Every message carries the stamp and the frame of the colour image it was computed from.
"""

from __future__ import annotations

import array
from collections.abc import Sequence

import numpy as np
from builtin_interfaces.msg import Duration, Time
from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion
from jaxtyping import Float
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker

from pop_core.estimate import BodyEstimate
from pop_core.geometry.rotation import to_quat_xyzw
from pop_core.rgbd import RgbdFrame, point_cloud

MESH_NAMESPACE = 'pop_mesh'
PALETTE = (
    (0.35, 0.62, 0.91), (0.95, 0.61, 0.29), (0.45, 0.76, 0.46), (0.87, 0.46, 0.56),
    (0.62, 0.53, 0.85), (0.85, 0.78, 0.35), (0.36, 0.76, 0.76), (0.72, 0.56, 0.44),
)
CLOUD_TYPE = np.dtype([
    ('x', '<f4'), ('y', '<f4'), ('z', '<f4'), ('rgb', '<u4'), ('person', '<u4')])
CLOUD_FIELDS = [
    PointField(name='x', offset=0, datatype=PointField.FLOAT32, count=1),
    PointField(name='y', offset=4, datatype=PointField.FLOAT32, count=1),
    PointField(name='z', offset=8, datatype=PointField.FLOAT32, count=1),
    # rviz and PCL read colour from the bits of a float.
    PointField(name='rgb', offset=12, datatype=PointField.FLOAT32, count=1),
    PointField(name='person', offset=16, datatype=PointField.UINT32, count=1),
]


def make_header(stamp_ns: int, frame_id: str) -> Header:
    """Return a header of a stamp [ns] and a frame."""
    sec, nanosec = divmod(stamp_ns, 1_000_000_000)
    return Header(stamp=Time(sec=sec, nanosec=nanosec), frame_id=frame_id)


def mesh_marker(person_id: int, frame_id: str, lifetime_s: float) -> Marker:
    """Return the triangle marker of one person, without stamp and points."""
    r, g, b = PALETTE[person_id % len(PALETTE)]
    marker = Marker(
        header=make_header(0, frame_id), ns=MESH_NAMESPACE, id=person_id,
        type=Marker.TRIANGLE_LIST, action=Marker.ADD, color=ColorRGBA(r=r, g=g, b=b, a=1.0),
        lifetime=_duration(lifetime_s))
    marker.pose.orientation.w = 1.0
    marker.scale.x = marker.scale.y = marker.scale.z = 1.0
    return marker


def delete_marker(person_id: int, stamp_ns: int, frame_id: str) -> Marker:
    """Return the marker that removes a person who left."""
    return Marker(
        header=make_header(stamp_ns, frame_id), ns=MESH_NAMESPACE, id=person_id,
        type=Marker.TRIANGLE_LIST, action=Marker.DELETE)


def body_poses(body: BodyEstimate) -> list[Pose]:
    """Return position [m] and orientation of the 24 joints in the camera frame."""
    quats = to_quat_xyzw(body.joint_rotations)
    return [
        Pose(position=Point(x=p[0], y=p[1], z=p[2]),
             orientation=Quaternion(x=q[0], y=q[1], z=q[2], w=q[3]))
        for p, q in zip(body.joints.tolist(), quats.tolist(), strict=True)
    ]


def joints_message(bodies: Sequence[BodyEstimate], header: Header) -> PoseArray:
    """Return 24 poses per person, person after person."""
    return PoseArray(header=header, poses=[pose for body in bodies for pose in body_poses(body)])


def cloud_message(
    frame: RgbdFrame, bodies: Sequence[BodyEstimate], ids: Sequence[int], header: Header
) -> PointCloud2:
    """Return the measured points of every person with colour and person id."""
    parts = [_person_points(frame, body, number) for body, number in zip(bodies, ids, strict=True)]
    points = np.concatenate(parts) if parts else np.zeros(0, CLOUD_TYPE)
    data = array.array('B')
    data.frombytes(points.tobytes())
    return PointCloud2(
        header=header, height=1, width=len(points), fields=CLOUD_FIELDS, is_bigendian=False,
        point_step=CLOUD_TYPE.itemsize, row_step=CLOUD_TYPE.itemsize * len(points), data=data,
        is_dense=True)


def triangle_points(
    vertices: Float[np.ndarray, 'v 3'], f: np.ndarray
) -> Float[np.ndarray, 'n 3']:
    """Return three corner points [m] per triangle, as TRIANGLE_LIST wants them."""
    return np.take(vertices, f.ravel(), axis=0)


def _person_points(frame: RgbdFrame, body: BodyEstimate, person_id: int) -> np.ndarray:
    p_camera, uv = point_cloud(frame, body.mask)
    columns, rows = uv.astype(np.int64).T
    red, green, blue = frame.rgb[rows, columns].astype(np.uint32).T
    points = np.empty(len(p_camera), CLOUD_TYPE)
    points['x'], points['y'], points['z'] = p_camera.T
    points['rgb'] = red << 16 | green << 8 | blue
    points['person'] = person_id
    return points


def _duration(seconds: float) -> Duration:
    sec, nanosec = divmod(round(seconds * 1e9), 1_000_000_000)
    return Duration(sec=sec, nanosec=nanosec)
