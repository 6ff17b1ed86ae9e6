"""Arms from files, for tests: those that palpate has, and some that are written down here."""

from functools import cache
from pathlib import Path

from palpate.sim import ArmFile, ArmModel
from palpate.sim.carriers.arm_file import ARMS

OWN = ("ur5e.xml", "panda.xml", "xarm6.xml")

LINK = '<geom type="capsule" size="0.03" fromto="0 0 0 0 0 0.1" mass="1"/>'

SCARA = f"""<mujoco model="scara">
  <compiler angle="degree"/>
  <default><joint damping="2" armature="0.2"/></default>
  <asset><mesh name="wedge" vertex="0 0 0  0.1 0 0  0 0.1 0  0 0 0.1"/></asset>
  <worldbody>
    <light pos="0 0 2"/>
    <frame pos="0 0 0.4" euler="0 0 90">
      <body name="one" euler="0 0 10">
        <joint name="a" axis="0 0 1" range="-150 150" ref="5"/>{LINK}
        <body name="two" pos="0.3 0 0">
          <joint name="b" axis="0 0 1" range="-140 140"/>{LINK}
          <frame pos="0.25 0 0" euler="180 0 0">
            <body name="three">
              <joint name="c" type="slide" axis="0 0 2" range="0 0.25" ref="0.1"/>{LINK}
              <body name="four">
                <joint name="d" axis="0 0 1" range="-170 170"/>{LINK}
                <site name="flange" pos="0 0 0.05" euler="10 20 30"/>
                <body name="jaw"><joint name="grip" type="slide" axis="1 0 0" range="0 0.02"/>
                  <geom type="mesh" mesh="wedge" mass="0.1"/></body>
              </body>
            </body>
          </frame>
        </body>
      </body>
    </frame>
  </worldbody>
  <actuator>
    <motor name="m" joint="a" gear="50" forcerange="-2 2" ctrlrange="-1 1"/>
    <motor joint="b" gear="50" forcerange="-1 1"/>
    <motor joint="c" forcerange="-200 200"/>
    <motor joint="d" gear="20" forcerange="-1 1"/>
    <general tendon="split"/>
  </actuator>
  <contact><exclude body1="three" body2="four"/></contact>
  <tendon><fixed name="split"><joint joint="grip" coef="0.5"/></fixed></tendon>
  <equality><joint joint1="grip"/></equality>
  <sensor><jointpos joint="a"/><framepos objtype="site" objname="flange"/></sensor>
  <custom><numeric name="joint_speed" data="3 3 0.5 6"/></custom>
  <keyframe><key name="home" qpos="0.3 0.8 0.12 0.1 0.01"/></keyframe>
</mujoco>
"""
"""Three hinges and a slide, written as people write: degrees, frames, defaults, meshes, motors, and a gripper."""

GANTRY = f"""<mujoco model="gantry">
  <default><joint type="slide" range="-0.3 0.3" actuatorfrcrange="-300 300"/></default>
  <worldbody>
    <body name="x"><joint name="x" axis="1 0 0"/>{LINK}
      <body name="y"><joint name="y" axis="0 1 0"/>{LINK}
        <body name="z" pos="0 0 0.5"><joint name="z" axis="0 0 1"/>{LINK}<site name="flange"/></body>
      </body>
    </body>
  </worldbody>
  <custom><numeric name="joint_speed" data="0.5 0.5 0.5"/></custom>
</mujoco>
"""


MOBILE = """<mujoco model="mobile">
  <option integrator="RK4" impratio="10"/>
  <default><joint axis="0 1 0"/></default>
  <worldbody>
    <body><freejoint/><geom size="0.1" contype="1"/>
      <body name="stand" pos="0 0 0.2"><geom size="0.1" mass="0"/>
        <body><joint name="a" axis="0 0 1"/><geom size="0.05"/>
          <body pos="0 0 0.3"><joint name="b"/><geom size="0.05"/>
            <body pos="0 0 0.3"><joint name="c"/><geom size="0.05"/>
              <site name="flange" pos="0 0 0.2"/>
              <body name="hand" pos="0 0 0.2">
                <inertial pos="0 0 0" mass="1" diaginertia="1e-3 1e-3 3e-3"/>
                <body name="left"><joint name="grip_a"/><geom size="0.01"/></body>
                <body name="right"><joint name="grip_b"/><geom size="0.01"/></body>
              </body>
            </body>
          </body>
        </body>
      </body>
    </body>
    <body name="handle" mocap="true"/>
  </worldbody>
  <equality>
    <connect body1="left" body2="right" anchor="0 0 0"/>
    <weld body1="handle" body2="hand"/>
  </equality>
  <worldbody><body name="other"/></worldbody>
  <actuator>
    <motor joint="a" gear="20" ctrlrange="-2 2"/><motor joint="b" ctrlrange="-40 40"/>
    <general jointinparent="c" gainprm="10" ctrlrange="-4 5"/>
  </actuator>
  <custom><numeric name="joint_speed" data="2 2 2"/></custom>
</mujoco>
"""
"""Three hinges without end on a base that floats, with a hand, as files of whole robots have them."""


@cache
def own_arm(name: str) -> ArmModel:
    """Return an arm that palpate has."""
    return ArmFile(ARMS / name, "flange").read()


def written(folder: Path, text: str, name: str = "arm.xml", flange: str = "flange") -> ArmFile:
    """Return an arm's file with this text."""
    (folder / name).write_text(text)
    return ArmFile(folder / name, flange)
