"""Planar arms, written by the project as URDF."""

from __future__ import annotations

import math

_WIDTH = (
    0.08  # [m] edge of the square cross section: a slender link, as in the thesis's drawings of planar arms
)
_DENSITY = 2700.0 * 0.1  # [kg/m^3] aluminium, a tenth of the section filled: a tube
_VELOCITY_LIMIT = 5.0  # [rad/s] that of the thesis's toy arm
_PEAK_ACCELERATION = (
    10.0  # [rad/s^2] the effort limit lets a stretched arm reach this in the horizontal plane
)


def planar_arm(num_joints: int, link_length: float = 0.5) -> str:
    """URDF text of an arm in the x-y plane: equal box links along x, joints about z, limits ±pi.

    The links are `base`, `link1` … `linkN` (frame at the joint, box from there along x) and `tip`, the end of
    the last link. Gravity (along z) does not load the joints.

    Args:
        num_joints: number of joints and links, at least 1.
        link_length: distance between joints [m].

    Raises:
        ValueError: a number of joints or a length that is not positive.
    """
    if num_joints < 1:
        raise ValueError(f"num_joints is {num_joints}, must be at least 1")
    if not 0.0 < link_length < float("inf"):
        raise ValueError(f"link_length is {link_length}, must be positive and finite [m]")
    mass = _DENSITY * _WIDTH**2 * link_length
    along = mass * _WIDTH**2 / 6.0
    across = mass * (_WIDTH**2 + link_length**2) / 12.0
    parts = [f'<robot name="planar{num_joints}">', '  <link name="base"/>']
    for i in range(1, num_joints + 1):
        reach = (num_joints + 1 - i) * link_length  # from this joint to the tip, stretched
        effort = mass * reach / link_length * reach**2 / 3.0 * _PEAK_ACCELERATION
        shift = 0.0 if i == 1 else link_length
        parent = "base" if i == 1 else f"link{i - 1}"
        parts.append(f"""\
  <joint name="joint{i}" type="revolute">
    <parent link="{parent}"/>
    <child link="link{i}"/>
    <origin xyz="{shift:.12g} 0 0"/>
    <axis xyz="0 0 1"/>
    <limit lower="{-math.pi}" upper="{math.pi}" velocity="{_VELOCITY_LIMIT}" effort="{effort:.6g}"/>
  </joint>
  <link name="link{i}">
    <inertial>
      <origin xyz="{link_length / 2:.12g} 0 0"/>
      <mass value="{mass:.12g}"/>
      <inertia ixx="{along:.12g}" ixy="0" ixz="0" iyy="{across:.12g}" iyz="0" izz="{across:.12g}"/>
    </inertial>
    <collision>
      <origin xyz="{link_length / 2:.12g} 0 0"/>
      <geometry><box size="{link_length:.12g} {_WIDTH} {_WIDTH}"/></geometry>
    </collision>
  </link>""")
    parts.append(f"""\
  <joint name="tip_joint" type="fixed">
    <parent link="link{num_joints}"/>
    <child link="tip"/>
    <origin xyz="{link_length:.12g} 0 0"/>
  </joint>
  <link name="tip"/>
</robot>""")
    return "\n".join(parts) + "\n"
