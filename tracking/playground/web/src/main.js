// The page: read what is in it, hold the policy against its trace, then dance.

import { goldenDifference, Policy } from "./policy.js";
import { Robot } from "./robot.js";
import { Stage } from "./stage.js";

const AFTER_FALL_S = 1.2;
const PUSHES = { ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowLeft: [0, 1], ArrowRight: [0, -1] };
const find = (id) => document.getElementById(id);

function bytes(text) {
  return Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
}

async function unzipped(text) {
  const stream = new Blob([bytes(text)]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

// Arrays are told as {"f32": base64} or {"u32": base64}; everything else as it is.
function revived(value) {
  if (Array.isArray(value)) return value.map(revived);
  if (value === null || typeof value !== "object") return value;
  if (typeof value.f32 === "string") return new Float32Array(bytes(value.f32).buffer);
  if (typeof value.u32 === "string") return new Uint32Array(bytes(value.u32).buffer);
  return Object.fromEntries(Object.entries(value).map(([k, v]) => [k, revived(v)]));
}

class Show {
  constructor(told, policy, robot, stage) {
    Object.assign(this, { told, policy, robot, stage, falls: 0, playing: true });
    this.begin();
  }

  begin() {
    this.robot.start(0);
    this.policy.start(this.robot.measured, 0);
    this.waits = 0;
  }

  // One control period.
  advance() {
    const { robot, policy } = this;
    const last = policy.motion.frames - 1;
    if (this.waits > 0 || policy.frame >= last) {
      this.waits += this.told.dt; // it is looked at as it fell: nothing but its soles meets the floor
      if (this.waits > AFTER_FALL_S) this.begin();
      return;
    }
    robot.advance(policy.act(robot.measured), Math.round(find("late").value / 1000 / robot.model.opt.timestep));
    if (robot.fell(policy.frame)) {
      this.falls += 1;
      this.waits = this.told.dt;
    }
  }

  tell() {
    const now = this.policy.frame * this.told.dt;
    find("time").textContent = `${now.toFixed(1)} of ${((this.policy.motion.frames - 1) * this.told.dt).toFixed(1)} s`;
    find("bar").style.width = `${(100 * this.policy.frame) / (this.policy.motion.frames - 1)}%`;
    find("falls").textContent = this.waits > 0 && this.policy.frame < this.policy.motion.frames - 1 ? `fell; falls: ${this.falls}` : `falls: ${this.falls}`;
  }

  draw() {
    const { stage, robot } = this;
    stage.pose(stage.robot, robot.data);
    stage.pose(stage.ghost, robot.meant(this.policy.frame));
    stage.show(stage.ghost, find("ghost").checked);
    stage.follow(robot.data.qpos);
    stage.draw();
  }

  controls() {
    const push = ([forward, left]) => {
      const strength = Number(find("strength").value);
      this.robot.push(strength * forward, strength * left);
    };
    document.querySelectorAll("[data-push]").forEach((b) => b.addEventListener("click", () => push(PUSHES[b.dataset.push])));
    window.addEventListener("keydown", (e) => {
      if (e.key in PUSHES) push(PUSHES[e.key]);
      else if (e.key === " ") find("play").click();
      else return;
      e.preventDefault();
    });
    find("play").addEventListener("click", () => {
      this.playing = !this.playing;
      find("play").textContent = this.playing ? "pause" : "play";
    });
    find("again").addEventListener("click", () => this.begin());
    find("friction").value = this.told.friction;
    find("friction").addEventListener("input", (e) => (this.robot.friction = Number(e.target.value)));
    find("heavier").addEventListener("input", (e) => (this.robot.heavier = Number(e.target.value)));
    document.querySelectorAll("input[type=range]").forEach((slider) => {
      const told = () => (find(`${slider.id}-now`).textContent = slider.value);
      slider.addEventListener("input", told);
      told();
    });
  }

  run() {
    let before = performance.now(), owed = 0;
    const tick = (now) => {
      owed = Math.min(0.1, owed + (now - before) / 1000);
      before = now;
      while (owed >= this.told.dt) {
        owed -= this.told.dt;
        if (this.playing) this.advance();
      }
      this.tell();
      this.draw();
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }
}

async function main() {
  const told = revived(JSON.parse(new TextDecoder().decode(await unzipped(find("dance").textContent.trim()))));
  const policy = new Policy(told);
  const difference = told.golden ? goldenDifference(policy, told.golden) : NaN;
  const held = !(difference >= told.tolerance);
  find("golden").textContent = told.golden
    ? `${held ? "✓" : "✗"} what the trainer made of its first ${(told.golden.periods * told.dt).toFixed(0)} s, repeated here to ${difference.toExponential(1)}`
    : "no golden trace came with this policy";
  const robot = await Robot.create(told, await unzipped(find("wasm").textContent.trim()));
  const show = new Show(told, policy, robot, new Stage(find("stage"), told.surface));
  show.controls();
  show.run();
  window.dance = show; // for who looks closer, in the console
}

main().catch((error) => (find("golden").textContent = `this browser cannot show it: ${error.message}`));
