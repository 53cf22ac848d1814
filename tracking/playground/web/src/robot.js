// The robot's physics: MuJoCo, as it is built for browsers.

import loadMujoco from "@mujoco/mujoco";

import { fromYaw, rotate, yawOf } from "./rotation.js";

export class Robot {
  static async create(data, wasm) {
    const robot = new Robot();
    const mujoco = await loadMujoco({ wasmBinary: wasm });
    const model = mujoco.MjModel.from_xml_string(data.model_xml);
    Object.assign(robot, { mujoco, model, data: new mujoco.MjData(model), ghost: new mujoco.MjData(model), told: data });
    robot.joints = data.order.length;
    robot.mass = Array.from(model.body_mass);
    robot.inertia = Array.from(model.body_inertia);
    robot.late = [];
    return robot;
  }

  // Stand as the reference does in a frame.
  start(frame) {
    const { nq, nv } = this.model;
    this.mujoco.mj_resetData(this.model, this.data);
    this.data.qpos.set(this.told.qpos.subarray(frame * nq, (frame + 1) * nq));
    this.data.qvel.set(this.told.qvel.subarray(frame * nv, (frame + 1) * nv));
    this.late = [];
    this.mujoco.mj_kinematics(this.model, this.data);
  }

  // What its sensors tell, joints in the policy's order.
  get measured() {
    const { qpos, qvel } = this.data;
    return {
      quat: Array.from(qpos.subarray(3, 7)), gyro: Array.from(qvel.subarray(3, 6)),
      joint_pos: this.told.order.map((j) => qpos[7 + j]), joint_vel: this.told.order.map((j) => qvel[6 + j]),
    };
  }

  // One control period; motors hear what was asked so many physics steps before.
  advance(targets, lateSteps) {
    for (let k = 0; k < this.told.substeps; k++) {
      this.late.push(targets);
      while (this.late.length > lateSteps + 1) this.late.shift();
      this.told.order.forEach((j, i) => (this.data.ctrl[j] = this.late[0][i]));
      this.mujoco.mj_step(this.model, this.data);
    }
    this.mujoco.mj_kinematics(this.model, this.data);
  }

  // Change the root's velocity at once, in its own heading [m/s].
  push(forward, left) {
    const way = rotate(fromYaw(yawOf(Array.from(this.data.qpos.subarray(3, 7)))), [forward, left, 0]);
    way.forEach((v, i) => (this.data.qvel[i] += v));
  }

  set friction(value) {
    this.told.soles.forEach((name) => (this.model.geom_friction[3 * this.mujoco.mj_name2id(this.model, 5, name)] = value));
  }

  set heavier(factor) {
    this.model.body_mass.set(this.mass.map((v) => factor * v));
    this.model.body_inertia.set(this.inertia.map((v) => factor * v));
    this.mujoco.mj_setConst(this.model, this.ghost);
  }

  // The anchor off its height by more than the rule allows, or tilted.
  fell(frame) {
    const { body, height, tilt } = this.told.rules;
    const pose = ({ xpos, xquat }) => [xpos[3 * body + 2], rotate(Array.from(xquat.subarray(4 * body, 4 * body + 4)), [0, 0, 1])[2]];
    const [z, up] = pose(this.data);
    const [meantZ, meantUp] = pose(this.meant(frame));
    return Math.abs(z - meantZ) > height || Math.abs(up - meantUp) > tilt;
  }

  // Pose the ghost as the reference is, in the heading and place in which the robot began.
  meant(frame) {
    const { nq } = this.model;
    this.ghost.qpos.set(this.told.qpos.subarray(frame * nq, (frame + 1) * nq));
    this.mujoco.mj_kinematics(this.model, this.ghost);
    return this.ghost;
  }
}

