"""Files of other programs: calibrations, launch files, pose graphs. numpy computes what is right."""

from __future__ import annotations

import pathlib
import random

import numpy as np
import pytest
import tfdude
from helpers import eventually
from tfdude import FrameSpec, Transform

T_CAM_IMU = [[0.01779318, 0.99967549, -0.01822936, 0.07008565],
             [-0.9998017, 0.01795239, 0.00860714, -0.01771023],
             [0.00893160, 0.01807260, 0.99979678, 0.00399246],
             [0.0, 0.0, 0.0, 1.0]]
T_1_0 = [[0.99998854, 0.00216014, 0.00427195, -0.11003785],
         [-0.00221074, 0.99992702, 0.01187697, 0.00045792],
         [-0.00424598, -0.01188627, 0.99992034, -0.00064487],
         [0.0, 0.0, 0.0, 1.0]]


def rows(matrix) -> str:
    return "".join(f"  - {list(row)}\n" for row in matrix)


# As kalibr_calibrate_imu_camera writes it; cam1 has no T_cam_imu before that has run.
KALIBR = f"""cam0:
  camera_model: pinhole
  intrinsics: [461.629, 460.152, 362.680, 246.049]
  T_cam_imu:
{rows(T_CAM_IMU)}  timeshift_cam_imu: -8.121e-05
  rostopic: /cam0/image_raw
cam1:
  camera_model: omni
  T_cn_cnm1:
{rows(T_1_0)}  cam_overlaps: [0]
"""

EASY_HANDEYE = """parameters:
  eye_on_hand: true
  freehand_robot_movement: true
  move_group: manipulator
  namespace: /arm_eye_on_hand/
  robot_base_frame: base_link
  robot_effector_frame: tool0
  tracking_base_frame: camera_color_optical_frame
  tracking_marker_frame: marker
transformation: {qw: 0.5, qx: -0.5, qy: 0.5, qz: -0.5, x: 0.1, y: -0.02, z: 0.3}
"""
EASY_HANDEYE_2 = """parameters:
  name: cell
  calibration_type: eye_on_base
  robot_base_frame: base_link
  robot_effector_frame: tool0
  tracking_base_frame: camera_color_optical_frame
  tracking_marker_frame: marker
transform:
  translation: {x: 1.0, y: 0.25, z: 0.5}
  rotation: {x: 0.0, y: 0.6, z: 0.0, w: 0.8}
"""
ROS_1 = """<?xml version="1.0"?>
<launch>
  <!-- <node pkg="tf" type="static_transform_publisher" name="old" args="9 9 9 0 0 0 a b 100"/> -->
  <group if="$(arg sim)"><node pkg="gazebo_ros" type="gzserver" name="gazebo"/></group>
  <node pkg="tf" type="static_transform_publisher" name="one" args="1 2 3 0.3 0.2 0.1 /base /laser 100"/>
  <node pkg="tf" type="static_transform_publisher" name="two"
        args="0 0 1 0.5 0.5 0.5 0.5 base imu 50"/>
  <group unless="true">
    <node pkg="tf2_ros" type="static_transform_publisher" name="off" args="7 0 0 0 0 0 base off"/>
  </group>
  <node pkg="tf2_ros" type="static_transform_publisher" name="three" args="0 1 0 0 0 0.6 0.8 base gps"/>
  <node pkg="tf2_ros" type="static_transform_publisher" name="four" args="0 1 0 0.4 0 0 gps mast __name:=x"/>
</launch>
"""
ROS_2 = """<launch>
  <node pkg="tf2_ros" exec="static_transform_publisher" name="one"
        args="--x 0.1 --y -0.2 --yaw 1.5 --roll -0.3 --frame-id base --child-frame-id lidar --ros-args -p a:=b"/>
  <node pkg="tf2_ros" exec="static_transform_publisher"
        args="--z 0.5 --qy 0.6 --qw 0.8 --frame-id base --child-frame-id mast"/>
</launch>
"""
ROS_2_PYTHON = """from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description():
    # Node(package='tf2_ros', executable='static_transform_publisher', arguments=['9', '9'])
    return LaunchDescription([
        Node(package='tf2_ros', executable='static_transform_publisher', name="one",
             arguments=['0.1', '0', '0.2', '0.3', '0', '0', 'base', 'lidar']),
        Node(
            package="tf2_ros",
            arguments=["--x", "1", "--yaw", str(-0.5), "--frame-id", "base",
                       "--child-frame-id", "gps",],
            executable="static_transform_publisher"),
        Node(package='tf2_ros', executable='static_transform_publisher',
             arguments='0 0 1e-1 0 0 0 1 base imu'.split(' ')),
        ExecuteProcess(cmd=['ros2', 'run', 'tf2_ros', 'static_transform_publisher',
                            '0', '0', '2', '0', '0', '0', 'base', 'mast']),
        Node(package='rviz2', executable='rviz2', arguments=['-d', config]),
    ])
"""
ROS_2_YAML = """%YAML 1.2
---
launch:
- arg: {name: sim, default: "false"}
- node:
    pkg: tf2_ros
    args: "--x 0.1 --y -0.2 --yaw 1.5 --roll -0.3 --frame-id /base --child-frame-id lidar"
    exec: static_transform_publisher
    name: one
- node: {pkg: tf2_ros, exec: static_transform_publisher, args: "--z 0.5 --qy 0.6 --qw 0.8
    --frame-id base --child-frame-id mast"}
- group:
  - push_ros_namespace: {namespace: robot}
  - node:
      pkg: tf2_ros
      exec: static_transform_publisher
      args: >-
        1 2 3
        0.3 0.2 0.1
        mast gps
- node: {pkg: gazebo_ros, exec: gzserver, if: $(var sim)}
- group:
    if: true
    children:
    - node:
        pkg: tf2_ros
        exec: static_transform_publisher
        unless: false
        args: 0 1 0 0 0 0 base imu
    - node:
        pkg: tf2_ros
        exec: static_transform_publisher
        if: "0"
        args: 7 0 0 0 0 0 base off
- group:
    unless: "true"
    children: [{node: {pkg: tf2_ros, exec: static_transform_publisher, args: 7 0 0 0 0 0 base never}}]
"""
SHELL = """#!/bin/sh
# rosrun tf static_transform_publisher 9 9 9 0 0 0 a b 10
rosrun tf static_transform_publisher 1 0 0 0.1 0 0 "map" odom 100 &
ros2 run tf2_ros static_transform_publisher --x 2 \\
    --frame-id odom --child-frame-id base  # a comment
"""
OPENCV = """%YAML:1.0
---
M1: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 500., 0., 320., 0., 500., 240., 0., 0., 1. ]
R: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 9.9998854e-01, 2.16014e-03, 4.27195e-03,
       -2.21074e-03, 9.9992702e-01, 1.187697e-02, -4.24598e-03,
       -1.188627e-02, 9.9992034e-01 ]
T: !!opencv-matrix
   rows: 3
   cols: 1
   dt: d
   data: [ -110.03785, 0.45792, -0.64487 ]
"""
COLMAP = """# Image list with two lines of data per image:
#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME
#   POINTS2D[] as (X, Y, POINT3D_ID)
# Number of images: 2, mean observations per image: 1
1 0.851773 0.0165051 0.503764 -0.142941 -0.737434 1.02973 3.74354 1 P1180141.JPG
2362.39 248.498 58396 1784.7 268.254 59027
2 0.9998 0.02 0 0 1 2 3 1 left/P1180142.JPG

"""


def rotation(q) -> np.ndarray:
    """Of a quaternion x y z w of any length."""
    x, y, z, w = np.array(q) / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def pose(t, R) -> np.ndarray:
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R, t
    return X


def fixed_axes(roll, pitch, yaw) -> np.ndarray:
    def about(axis, angle):
        R = np.eye(3)
        i, j = [k for k in range(3) if k != axis]
        c, s = np.cos(angle), np.sin(angle) * (-1 if axis == 1 else 1)
        R[i, i], R[i, j], R[j, i], R[j, j] = c, -s, s, c
        return R
    return about(2, yaw) @ about(1, pitch) @ about(0, roll)


def read(tmp_path: pathlib.Path, text: str, **options) -> dict[str, FrameSpec]:
    file = tmp_path / "file"
    file.write_text(text)
    frames = tfdude.read_frames(str(file), **options)
    return {frame.id: frame for frame in frames}


def check(frame: FrameSpec, parent: str, X: np.ndarray, tolerance=1e-12) -> None:
    assert frame.parent == parent
    assert np.allclose(frame.X_PC.matrix, X, rtol=0, atol=tolerance)


def message(tmp_path, text, **options) -> str:
    with pytest.raises(tfdude.TransformException) as error:
        read(tmp_path, text, **options)
    return str(error.value).replace(str(tmp_path) + "/", "")


def test_kalibr_places_cameras_in_the_imu_or_in_the_camera_before(tmp_path):
    frames = read(tmp_path, KALIBR)
    assert list(frames) == ["cam0", "cam1"]
    # The matrices have 8 digits.
    check(frames["cam0"], "imu0", np.linalg.inv(T_CAM_IMU), 1e-7)
    check(frames["cam1"], "cam0", np.linalg.inv(T_1_0), 1e-7)
    assert not frames["cam0"].X_PC.complete
    # With both, the chain must close.
    both = KALIBR + "  T_cam_imu:\n" + rows((np.array(T_1_0) @ T_CAM_IMU).tolist())
    check(read(tmp_path, both)["cam1"], "imu0", np.linalg.inv(T_CAM_IMU) @ np.linalg.inv(T_1_0), 1e-7)
    assert message(tmp_path, KALIBR + "  T_cam_imu:\n" + rows(T_CAM_IMU)) == (
        "file:14: cam1: T_cn_cnm1 contradicts T_cam_imu of cam0 and of cam1")
    # Over cameras that only T_cn_cnm1 places, before and after those with T_cam_imu.
    three = KALIBR + "cam2:\n  T_cn_cnm1:\n" + rows(T_1_0) + "  T_cam_imu:\n"
    X_2I = np.array(T_1_0) @ np.array(T_1_0) @ np.array(T_CAM_IMU)
    frames = read(tmp_path, three + rows(X_2I.tolist()))
    check(frames["cam2"], "imu0", np.linalg.inv(X_2I), 1e-6)
    X_2I[0, 3] += 0.01
    assert message(tmp_path, three + rows(X_2I.tolist())) == (
        "file:21: cam2: T_cn_cnm1 contradicts T_cam_imu of cam0 and of cam2")
    X_1I = np.array(T_1_0) @ np.array(T_CAM_IMU)
    late = f"cam0: {{}}\ncam1:\n  T_cn_cnm1:\n{rows(T_1_0)}  T_cam_imu:\n{rows(X_1I.tolist())}"
    frames = read(tmp_path, late)
    check(frames["cam0"], "imu0", np.linalg.inv(T_CAM_IMU), 1e-6)
    check(frames["cam1"], "imu0", np.linalg.inv(X_1I), 1e-6)
    assert message(tmp_path, late.replace("cam1", "cam2")) == (
        "file:4: cam2: T_cn_cnm1: there is no camera before")
    flat = f"cam0: {{}}\ncam1:\n  T_cn_cnm1: {np.array(T_1_0).ravel().tolist()}\n"
    check(read(tmp_path, flat)["cam1"], "cam0", np.linalg.inv(T_1_0), 1e-7)


def test_kalibr_says_what_is_wrong_and_where(tmp_path):
    assert message(tmp_path, "cam0: {}\ncam1:\n  rostopic: /b\n") == (
        "file:3: cam1 has neither T_cam_imu nor T_cn_cnm1")
    assert message(tmp_path, KALIBR.replace("0.99967549", "1.9")) == (
        "file:5: cam0: T_cam_imu: the upper left 3x3 is no rotation")
    assert message(tmp_path, KALIBR.replace("0.0, 0.0, 0.0, 1.0", "0, 0, 0, 2", 1)) == (
        "file:5: cam0: T_cam_imu: the last row is not 0 0 0 1")
    assert message(tmp_path, KALIBR.replace("0.99967549", "nought")) == (
        "file:5: cam0: T_cam_imu is 'nought', which is not a number")
    assert message(tmp_path, "cam0:\n  T_cam_imu: [1, 2]\n") == "file:2: cam0: T_cam_imu is not a 4x4 matrix"
    assert message(tmp_path, "cam0:\n  T_cn_cnm1: 3\n", format="kalibr") == (
        "file:2: cam0: T_cn_cnm1 is not a 4x4 matrix")
    assert message(tmp_path, "cam0: {}\n") == "file: has no frame that is placed in another"
    mirrored = np.diag([1, 1, -1, 1]).tolist()
    assert "no rotation" in message(tmp_path, "cam0:\n  T_cam_imu:\n" + rows(mirrored))


def test_hand_eye_calibrations_of_both_versions(tmp_path):
    frames = read(tmp_path, EASY_HANDEYE)
    check(frames["camera_color_optical_frame"], "tool0", pose([0.1, -0.02, 0.3], rotation([-0.5, 0.5, -0.5, 0.5])))
    early = EASY_HANDEYE.replace("parameters:\n", "").replace("\n  ", "\n").replace("  eye", "eye")
    check(read(tmp_path, early)["camera_color_optical_frame"], "tool0",
          pose([0.1, -0.02, 0.3], rotation([-0.5, 0.5, -0.5, 0.5])))
    frames = read(tmp_path, EASY_HANDEYE_2)
    check(frames["camera_color_optical_frame"], "base_link", pose([1, 0.25, 0.5], rotation([0, 0.6, 0, 0.8])))
    assert message(tmp_path, EASY_HANDEYE.replace("eye_on_hand: true", "eye_on_hand: maybe")) == (
        "file:2: eye_on_hand is neither true nor false")
    assert message(tmp_path, EASY_HANDEYE.replace(", x: 0.1", "")) == "file:10: transformation: x is missing"
    assert message(tmp_path, EASY_HANDEYE.replace("robot_effector_frame", "effector")) == (
        "file: robot_effector_frame is missing")
    assert message(tmp_path, EASY_HANDEYE_2.replace("w: 0.8", "w: 0.1")) == (
        "file:9: transform: rotation has the norm 0.608276, not that of a unit quaternion")


def test_static_transform_publisher_in_xml_of_ros_1(tmp_path):
    frames = read(tmp_path, ROS_1)
    assert list(frames) == ["laser", "imu", "gps", "mast"]
    # x y z yaw pitch roll
    check(frames["laser"], "base", pose([1, 2, 3], fixed_axes(0.1, 0.2, 0.3)))
    check(frames["imu"], "base", pose([0, 0, 1], rotation([0.5, 0.5, 0.5, 0.5])))
    check(frames["gps"], "base", pose([0, 1, 0], rotation([0, 0, 0.6, 0.8])))
    check(frames["mast"], "gps", pose([0, 1, 0], fixed_axes(0, 0, 0.4)))
    assert message(tmp_path, ROS_1.replace("0 0 1 0.5", "$(arg x) 0 1 0.5")) == (
        "file:6: static_transform_publisher: '$(arg' is a substitution: put its value there")
    assert message(tmp_path, ROS_1.replace('unless="true"', 'unless="$(arg real)"')) == (
        "file:8: <group> depends on '$(arg real)': put true or false there")
    short = ROS_1.replace("0 1 0 0.4 0 0 gps", "0 1 0.4 0 0 gps")
    assert "has 7 arguments, but 8 are needed" in message(tmp_path, short)
    assert message(tmp_path, ROS_1.replace("base gps", "base imu")) == (
        "file:11: frame 'imu': is placed twice, before in line 6")
    assert message(tmp_path, ROS_1.replace("</launch>", "")) == "file:2: not XML: parsing"


def test_static_transform_publisher_in_ros_2(tmp_path):
    frames = read(tmp_path, ROS_2)
    check(frames["lidar"], "base", pose([0.1, -0.2, 0], fixed_axes(-0.3, 0, 1.5)))
    check(frames["mast"], "base", pose([0, 0, 0.5], rotation([0, 0.6, 0, 0.8])))
    assert message(tmp_path, ROS_2.replace("--x", "--ex")) == (
        "file:2: static_transform_publisher: unknown argument '--ex'")
    assert message(tmp_path, ROS_2.replace("--z 0.5", "--z half")) == (
        "file:4: static_transform_publisher: --z is 'half', which is not a number")
    assert message(tmp_path, ROS_2.replace("--child-frame-id mast", "")) == (
        "file:4: static_transform_publisher: has no child frame")
    assert message(tmp_path, ROS_2.replace("--z 0.5", "--yaw 0.5")) == (
        "file:4: static_transform_publisher: a quaternion and angles are both given")


def test_static_transform_publisher_in_python_and_shell(tmp_path):
    frames = read(tmp_path, ROS_2_PYTHON)
    assert list(frames) == ["lidar", "gps", "imu", "mast"]
    check(frames["lidar"], "base", pose([0.1, 0, 0.2], fixed_axes(0, 0, 0.3)))
    check(frames["gps"], "base", pose([1, 0, 0], fixed_axes(0, 0, -0.5)))
    check(frames["imu"], "base", pose([0, 0, 0.1], np.eye(3)))
    check(frames["mast"], "base", pose([0, 0, 2], np.eye(3)))
    assert message(tmp_path, ROS_2_PYTHON.replace("'0.1',", "x,")) == (
        "file:9: an argument is computed by 'x': put its value there")
    assert message(tmp_path, ROS_2_PYTHON.replace("'lidar'])", "'lidar')")).startswith("file:")
    frames = read(tmp_path, SHELL)
    check(frames["odom"], "map", pose([1, 0, 0], fixed_axes(0, 0, 0.1)))
    check(frames["base"], "odom", pose([2, 0, 0], np.eye(3)))


def test_a_launch_file_in_python_decides_nothing(tmp_path):
    def launched(more):
        return message(tmp_path, f"LaunchDescription([Node(package='tf2_ros', "
                                 f"executable='static_transform_publisher', {more})])\n")

    assert launched("condition=IfCondition('false'), arguments=['1', '2', '3', '0', '0', '0', 'map', 'a']") == (
        "file:1: static_transform_publisher is started under a condition: write what happens")
    why = "static_transform_publisher is started under a condition: write what happens"
    call = ("Node(package='tf2_ros', executable='static_transform_publisher', "
            "arguments=['1', '2', '3', '0', '0', '0', 'map', 'a'])")
    for line, text in [
            (2, f"def generate_launch_description():\n    if False:\n        ld.add_action({call})\n"),
            (1, f"if use: ld.add_action({call})\n"),
            (3, f"if use:\n    pass\nelse:\n    ld.add_action(\n{call})\n"),
            (1, f"for i in range(0):\n    if i:\n        pass\n    ld.add_action({call})\n"),
            (1, f"while False:\n  with x:\n    ld.add_action({call})\n"),
            (3, f"try:\n    import x\nexcept ImportError:\n    ld.add_action({call})\n"),
            (2, f"match x:\n  case 1:\n    ld.add_action({call})\n"),
            (1, f"nodes = [{call} for _ in range(0)]\n"),
            (1, f"nodes = [{call} if use else None]\n"),
            (1, f"x = use and {call}\n"),
            (1, f"x = lambda: {call}\n"),
            (2, f"GroupAction(actions=[{call}],\n  condition=IfCondition('false'))\n"),
            (2, f"one = {call}\nif use:\n    ld.add_action(one)\n"),
            (3, f"def f():\n    if not use:\n        return []\n    return [{call}]\n"),
            (1, call.replace("publisher'", "publisher' if use else 'rviz2'") + "\n")]:
        assert message(tmp_path, f"{text}# LaunchDescription\n") == f"file:{line}: {why}", text
    for more in (" if use else []", " + more"):
        assert message(tmp_path, call.replace("'a']", "'a']" + more) + "  # LaunchDescription\n").startswith(
            "file:1: an argument is computed by"), more
    # What decides about something else does not matter.
    read(tmp_path, f"""from launch import LaunchDescription
def other():
    if use:
        return 1
def generate_launch_description():
    if use:
        name = 'if'
    elif \\
  x == 2:
        y = 3
    one = {call}
    return LaunchDescription([
        Node(executable='rviz2' if use else 'rqt', condition=IfCondition(use)),
        one, {call.replace("'a'", "'b'")}])
""")
    assert launched("**common") == "file:1: static_transform_publisher has no arguments here: write them there"


def test_static_transform_publisher_in_yaml(tmp_path):
    frames = read(tmp_path, ROS_2_YAML)
    assert list(frames) == ["lidar", "mast", "gps", "imu"]
    check(frames["lidar"], "base", pose([0.1, -0.2, 0], fixed_axes(-0.3, 0, 1.5)))
    check(frames["mast"], "base", pose([0, 0, 0.5], rotation([0, 0.6, 0, 0.8])))
    check(frames["gps"], "mast", pose([1, 2, 3], fixed_axes(0.1, 0.2, 0.3)))
    check(frames["imu"], "base", pose([0, 1, 0], np.eye(3)))
    assert message(tmp_path, ROS_2_YAML.replace("--x 0.1", "--x $(var x)")) == (
        "file:7: static_transform_publisher: '$(var' is a substitution: put its value there")
    assert message(tmp_path, ROS_2_YAML.replace("--x 0.1", "--ex 0.1")) == (
        "file:7: static_transform_publisher: unknown argument '--ex'")
    for given, line in (("if: true", 23), ("unless: false", 28)):
        decided = given.split(": ")[0] + ": $(var sim)"
        assert message(tmp_path, ROS_2_YAML.replace(given, decided)).startswith(f"file:{line}: "), given
        assert message(tmp_path, ROS_2_YAML.replace(given, decided)).endswith(
            "depends on '$(var sim)': put true or false there")
    assert message(tmp_path, "launch:\n  static_transform_publisher\n") == (
        "file:2: launch is not a list of actions")
    assert message(tmp_path, "launch:\n- node: {exec: static_transform_publisher, args: [1, 2]}\n") == (
        "file:2: node: args is not text")
    assert message(tmp_path, "launch:\n- node: {exec: static_transform_publisher}\n").startswith(
        "file:2: static_transform_publisher: has 0 arguments, but 8 are needed")


def test_every_start_of_a_shell_script_is_read(tmp_path):
    run = "ros2 run tf2_ros static_transform_publisher"
    script = f"""source setup.bash && {run} 1 0 0 0 0 0 map a &
{run} 2 0 0 0 0 0 map b & {run} 3 0 0 0 0 0 map c &
sleep 1; {run} 4 0 0 0 0 0 map d > /dev/null 2>&1 &
echo "starting static_transform_publisher"  # {run} 5 0 0 0 0 0 map none
{run} --x 6 --frame-id map \\
  --child-frame-id 'e' 2>log &>>log
"""
    frames = read(tmp_path, script)
    assert {id: frame.X_PC.translation[0] for id, frame in frames.items()} == {"a": 1, "b": 2, "c": 3, "d": 4, "e": 6}
    assert message(tmp_path, f"if true; then\n{run} 1 0 0 0 0 0 map a\nfi\n") == (
        "file:2: static_transform_publisher is started under a condition, or in a loop: write what happens")
    assert list(read(tmp_path, f"for i in 1 2; do sleep 1; done\n{run} 1 0 0 0 0 0 map a\n")) == ["a"]


def test_opencv_maps_the_first_camera_to_the_second(tmp_path):
    frames = read(tmp_path, OPENCV, unit=1e-3, names={"left": "cam_l", "right": "cam_r"})
    expected = np.array(T_1_0)
    check(frames["cam_r"], "cam_l", np.linalg.inv(expected), 1e-7)
    assert message(tmp_path, OPENCV.replace("cols: 1\n", "cols: 2\n")) == "file:15: T: data are not rows x cols numbers"
    assert message(tmp_path, OPENCV.replace("R: !!", "Rot: !!")) == "file: R is missing"
    assert message(tmp_path, OPENCV, names={"top": "x"}) == "file: has no frame 'top'"
    assert message(tmp_path, OPENCV, unit=-1) == "file: the unit must be more than 0 m and at most 1e9 m"


def numeric_colmap_jacobian(q_xyzw, t) -> np.ndarray:
    """How the camera's pose in the world turns with (δ, τ), as Ceres and COLMAP change cam_from_world:
    the quaternion (sin|δ| δ/|δ|, cos|δ|) on the left of the rotation, τ added to the translation."""
    X_WC = np.linalg.inv(pose(t, rotation(q_xyzw)))
    J = np.zeros((6, 6))
    h = 1e-6
    for k in range(6):
        xi = []
        for sign in (1, -1):
            d = np.zeros(6)
            d[k] = sign * h
            n = np.linalg.norm(d[:3])
            q = np.array([*(np.sin(n) / n * d[:3]), np.cos(n)]) if n else np.array([0, 0, 0, 1])
            changed = np.linalg.inv(pose(np.array(t) + d[3:], rotation(q) @ rotation(q_xyzw)))
            E = np.linalg.inv(X_WC) @ changed
            xi.append([*E[:3, 3], E[2, 1] - E[1, 2], E[0, 2] - E[2, 0], E[1, 0] - E[0, 1]])
        J[:, k] = (np.array(xi[0]) - xi[1]) / (2 * h)
        J[3:, k] /= 2
    return J


def test_colmap_poses_and_pycolmap_covariances(tmp_path):
    frames = read(tmp_path, COLMAP)
    q, t = [0.0165051, 0.503764, -0.142941, 0.851773], [-0.737434, 1.02973, 3.74354]
    check(frames["P1180141.JPG"], "world", np.linalg.inv(pose(t, rotation(q))))
    check(frames["left/P1180142.JPG"], "world", np.linalg.inv(pose([1, 2, 3], rotation([0.02, 0, 0, 0.9998]))))
    rng = np.random.default_rng(3)
    A = rng.normal(size=(6, 6)) * [1e-3, 2e-3, 1e-3, 1e-2, 3e-2, 1e-2]
    sigma = A.T @ A
    covariances = tmp_path / "covariances.txt"
    np.savetxt(covariances, [[1, *sigma.ravel()]])
    frames = read(tmp_path, COLMAP, covariances=str(covariances))
    J = numeric_colmap_jacobian(q, t)
    assert np.allclose(frames["P1180141.JPG"].X_PC.covariance, J @ sigma @ J.T, rtol=1e-5, atol=1e-9)
    assert frames["P1180141.JPG"].correlation_unknown
    assert not frames["left/P1180142.JPG"].X_PC.complete
    # In another unit of length.
    scaled = read(tmp_path, COLMAP, covariances=str(covariances), unit=2.0)["P1180141.JPG"]
    D = np.diag([2, 2, 2, 1, 1, 1])
    assert np.allclose(scaled.X_PC.covariance, D @ J @ sigma @ J.T @ D, rtol=1e-5, atol=1e-8)
    np.savetxt(covariances, [[7, *sigma.ravel()]])
    assert message(tmp_path, COLMAP, covariances=str(covariances)) == "covariances.txt:1: there is no image 7"
    np.savetxt(covariances, [[1, *(-sigma).ravel()]])
    assert message(tmp_path, COLMAP, covariances=str(covariances)).startswith("covariances.txt:1: image 1: cov")
    assert "new P.JPG" in read(tmp_path, COLMAP.replace("left/P1180142.JPG", "new P.JPG "))
    assert message(tmp_path, COLMAP.replace("2362.39 248.498 58396 1784.7 268.254 59027\n", "")) == (
        "file:6: is not a line of points, X Y POINT3D_ID each; without points it is empty")
    assert message(tmp_path, COLMAP.replace("2 0.9998", "2 a"), format="colmap") == (
        "file:7: is not IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME")


def chain(n=3, **options) -> list[FrameSpec]:
    rng = np.random.default_rng(5)
    frames = []
    for i in range(n):
        q = rng.normal(size=4)
        frames.append(FrameSpec(f"f{i}", f"f{i - 1}" if i else "root",
                                Transform(rng.normal(size=3), q / np.linalg.norm(q), **options)))
    return frames


@pytest.mark.parametrize("format", ["kalibr", "eye-on-hand", "eye-on-base", "ros1", "ros2", "opencv", "colmap"])
def test_what_is_written_is_read_as_it_was(tmp_path, format):
    names = {"kalibr": {"imu0": "imu", "cam0": "f0", "cam1": "f1", "cam2": "f2"},
             "opencv": {"left": "root", "right": "f0"}, "colmap": {"world": "root"}}.get(format, {})
    frames = chain(1 if "eye" in format or format == "opencv" else 3)
    if format == "colmap":
        frames = [FrameSpec(f.id, "root", f.X_PC) for f in frames]
    if format == "kalibr":
        frames = [FrameSpec(f.id, "imu", f.X_PC) for f in frames]
    text = tfdude.write_frames(frames, format)
    back = read(tmp_path, text, names=names)
    assert list(back) == [f.id for f in frames]
    for frame in frames:
        check(back[frame.id], frame.parent, frame.X_PC.matrix, 1e-14)
    if format == "kalibr":  # a chain without an IMU
        text = tfdude.write_frames(chain(2), format)
        back = read(tmp_path, text, names={"cam0": "root", "cam1": "f0", "cam2": "f1"})
        for frame in chain(2):
            check(back[frame.id], frame.parent, frame.X_PC.matrix, 1e-14)


def test_formats_refuse_what_they_cannot_say():
    for frames, format, why in [
            (chain(2), "opencv", "a file of opencv has one edge, not 2"),
            (chain(2), "eye-on-hand", "a file of eye-on-hand has one edge, not 2"),
            (chain(2), "colmap", "frame 'f1': images.txt needs all frames in 'root'"),
            ([FrameSpec("a b", "c")], "ros2", "frame 'a b': a launch file cannot have the name 'a b'"),
            ([FrameSpec("a", "/b")], "ros1", "frame 'a': a launch file cannot have the name '/b'"),
            ([FrameSpec("a")], "ros1", "frame 'a': is a root, and has no edge"),
            ([], "g2o", "there are no edges to write"),
            (chain(2), "g2o", "frame 'f0': its covariance is not specified; g2o needs one"),
            (chain(1, covariance="exact"), "g2o", "frame 'f0': an axis is known exactly; g2o needs an error on each"),
            (chain(1), "tum", "unknown format 'tum'; known are kalibr, eye-on-hand, eye-on-base, ros1, ros2, opencv, "
                              "colmap, g2o")]:
        with pytest.raises(tfdude.TransformException) as error:
            tfdude.write_frames(frames, format)
        assert str(error.value) == why


def test_names_and_files(tmp_path):
    frames = read(tmp_path, KALIBR, prefix="head_", names={"imu0": "imu_link"}, covariance=np.eye(6) * 1e-6)
    assert [(f.id, f.parent) for f in frames.values()] == [("head_cam0", "imu_link"), ("head_cam1", "head_cam0")]
    assert frames["head_cam0"].X_PC.stddev[0] == pytest.approx(1e-3)
    assert message(tmp_path, "hello\n") == "file: cannot tell its format: say which it is"
    circle = SHELL.replace('"map" odom', "base odom")
    assert message(tmp_path, circle) == "file:3: frame 'odom': is below itself"
    with pytest.raises(tfdude.TransformException, match="cannot be opened"):
        tfdude.read_frames(str(tmp_path / "none"))
    with pytest.raises(tfdude.TransformException, match="is longer than 64 MiB"):
        tfdude.read_frames("/dev/zero", format="colmap")


def test_broken_files_are_errors_and_nothing_else(tmp_path):
    seed = random.SystemRandom().randrange(2**32)
    print("seed", seed)
    rng = random.Random(seed)
    samples = {"kalibr": KALIBR, "eye-on-hand": EASY_HANDEYE, "ros1": ROS_1, "ros2": ROS_2_PYTHON, "opencv": OPENCV,
               "colmap": COLMAP, "g2o": tfdude.write_frames(chain(3, covariance=np.eye(6) * 1e-4), "g2o")}
    for format, text in samples.items():
        for _ in range(150):
            broken = list(text)
            for _ in range(rng.randrange(1, 6)):
                at = rng.randrange(len(broken))
                change = rng.randrange(3)
                if change == 0:
                    del broken[at:at + rng.randrange(1, 40)]
                elif change == 1:
                    broken.insert(at, rng.choice(list("[](){}'\"\\\n<>&-:0e9. ")))
                else:
                    broken[at] = chr(rng.randrange(1, 127))
                if not broken:
                    break
            try:
                read(tmp_path, "".join(broken), format=format)
            except tfdude.TransformException as error:
                assert "file" in str(error)
