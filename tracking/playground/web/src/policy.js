// A policy from nothing but its bundle: sensors in, servo targets out. The same road as tracking/policy/runner.py.

import { conjugate, fromAxis, fromYaw, multiply, twoColumns, yawOf } from "./rotation.js";

// Dense layers one after another, each on the numbers of the one before.
const LAYERS = {
  affine: ({ scale, shift }) => (x) => x.map((v, i) => (v - shift[i]) / scale[i]),
  dense: ({ weight, bias }) => (x) => {
    const out = new Float32Array(bias.length);
    for (let row = 0, at = 0; row < out.length; row++) {
      let sum = 0;
      for (let i = 0; i < x.length; i++) sum += weight[at++] * x[i];
      out[row] = sum + bias[row];
    }
    return out;
  },
  elu: () => (x) => x.map((v) => (v > 0 ? v : Math.expm1(v))),
  tanh: () => (x) => x.map(Math.tanh),
  relu: () => (x) => x.map((v) => Math.max(0, v)),
};

export class Policy {
  constructor(data) {
    Object.assign(this, data); // contract, motion, layers
    this.run = data.layers.map((layer) => LAYERS[layer.kind](layer));
    this.joints = this.contract.default_joint_pos.length;
    this.memory = 1 + Math.max(...this.contract.observation.map((row) => -Math.min(row.at, 0)));
  }

  // Begin at a frame; the heading of now is the motion's.
  start(measured, frame) {
    this.frame = frame;
    this.heading = fromYaw(yawOf(multiply(measured.quat, conjugate(this.row("root_quat", frame, 4)))));
    this.action = new Float32Array(this.joints);
    this.past = Array(this.memory).fill(measured); // the newest first; before the first there was, for all one knows, the same
  }

  row(table, frame, size) {
    return Array.from(this.motion[table].subarray(frame * size, (frame + 1) * size));
  }

  ahead(table, at, size) {
    return this.row(table, Math.min(this.frame + at, this.motion.frames - 1), size);
  }

  // The robot's anchor by its IMU and the joints between.
  anchor(measured) {
    let quat = measured.quat;
    for (const link of this.contract.anchor_chain) {
      quat = multiply(quat, link.quat);
      if (link.joint !== null) quat = multiply(quat, fromAxis(link.axis, measured.joint_pos[link.place]));
    }
    return quat;
  }

  // How each kind of row is computed; what it means stands in the contract.
  measure(kind, at) {
    const rest = this.contract.default_joint_pos, measured = this.past[-Math.min(at, 0)];
    switch (kind) {
      case "reference_joint_pos": return this.ahead("joint_pos", at, this.joints).map((v, i) => v - rest[i]);
      case "reference_joint_vel": return this.ahead("joint_vel", at, this.joints);
      case "reference_planar_velocity": return this.ahead("root_lin_vel", at, 3).slice(0, 2);
      case "reference_root_height": return this.ahead("root_pos", at, 3).slice(2);
      case "anchor_orientation": {
        const wanted = multiply(this.heading, this.ahead("anchor_quat", at, 4));
        return twoColumns(multiply(conjugate(this.anchor(measured)), wanted));
      }
      case "last_action": return Array.from(this.action);
      case "gyro": return measured.gyro;
      case "joint_pos": return measured.joint_pos.map((v, i) => v - rest[i]);
      case "joint_vel": return measured.joint_vel;
      default: throw new Error(`no row of kind ${kind}`);
    }
  }

  observation() {
    const rows = this.contract.observation;
    return Float32Array.from(rows.flatMap((r) => this.measure(r.kind, r.at).map((v) => r.scale * v)));
  }

  // Servo targets for the control period that begins now; the motion goes on by one frame.
  act(measured) {
    this.past = [measured, ...this.past.slice(0, -1)];
    this.seen = this.observation();
    this.action = this.run.reduce((x, layer) => layer(x), this.seen);
    this.frame = Math.min(this.frame + 1, this.motion.frames - 1);
    const c = this.contract;
    return this.row("targets", this.frame, this.joints).map((v, i) =>
      Math.min(c.target_upper[i], Math.max(c.target_lower[i], v + c.action_scale[i] * this.action[i])),
    );
  }
}

// The largest difference from what the trainer made of the same measurements.
export function goldenDifference(policy, golden) {
  let worst = 0;
  const far = (a, b) => a.forEach((v, i) => (worst = Math.max(worst, Math.abs(v - b[i]))));
  for (let k = 0; k < golden.periods; k++) {
    const part = (name, size) => Array.from(golden[name].subarray(k * size, (k + 1) * size));
    const measured = {
      quat: part("quat", 4), gyro: part("gyro", 3),
      joint_pos: part("joint_pos", policy.joints), joint_vel: part("joint_vel", policy.joints),
    };
    if (k === 0) policy.start(measured, policy.motion.start);
    const target = policy.act(measured);
    far(policy.seen, part("observation", policy.seen.length));
    far(policy.action, part("action", policy.joints));
    far(target, part("target", policy.joints));
  }
  return worst;
}
