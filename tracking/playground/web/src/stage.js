// The scene: robot, ghost, floor, a camera that follows.

import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

export class Stage {
  constructor(canvas, pieces) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
    this.renderer.shadowMap.enabled = true;
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color(0x20252e);
    this.scene.fog = new THREE.Fog(0x20252e, 8, 22);
    this.camera = new THREE.PerspectiveCamera(38, 1, 0.05, 60);
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(3.4, -1.2, 1.3);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.target.set(0, 0, 0.75);
    this.controls.enableDamping = true;
    this.#light();
    this.robot = this.#figure(pieces, null);
    this.ghost = this.#figure(pieces, new THREE.MeshStandardMaterial({ color: 0x59bfff, transparent: true, opacity: 0.22, depthWrite: false }));
    new ResizeObserver(() => this.#resize()).observe(canvas.parentElement);
    this.#resize();
  }

  #light() {
    this.scene.add(new THREE.HemisphereLight(0xdfe8ff, 0x404a55, 1.6));
    this.sun = new THREE.DirectionalLight(0xffffff, 2.2);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(1024, 1024);
    const box = this.sun.shadow.camera;
    [box.left, box.right, box.top, box.bottom] = [-1.6, 1.6, 1.6, -1.6];
    this.scene.add(this.sun, this.sun.target);
    const floor = new THREE.Mesh(new THREE.PlaneGeometry(60, 60), new THREE.MeshStandardMaterial({ color: 0x39414d, roughness: 0.95 }));
    floor.receiveShadow = true;
    const grid = new THREE.GridHelper(60, 60, 0x59636f, 0x4a535f);
    grid.rotation.x = Math.PI / 2;
    grid.position.z = 0.001;
    this.scene.add(floor, grid);
  }

  // A group for every body that has a surface, and its place in the model.
  #figure(pieces, veil) {
    const bodies = new Map();
    for (const piece of pieces) {
      const shape = new THREE.BufferGeometry();
      shape.setAttribute("position", new THREE.BufferAttribute(piece.vertices, 3));
      shape.setIndex(new THREE.BufferAttribute(piece.faces, 1));
      const flat = shape.toNonIndexed(); // edges stay edges
      flat.computeVertexNormals();
      const [r, g, b] = piece.rgba;
      const colour = new THREE.Color().setRGB(r, g, b, THREE.SRGBColorSpace);
      const mesh = new THREE.Mesh(flat, veil ?? new THREE.MeshStandardMaterial({ color: colour, roughness: 0.55, metalness: 0.15 }));
      mesh.castShadow = !veil;
      if (!bodies.has(piece.body)) {
        bodies.set(piece.body, new THREE.Group());
        this.scene.add(bodies.get(piece.body));
      }
      bodies.get(piece.body).add(mesh);
    }
    return bodies;
  }

  pose(figure, data) {
    for (const [body, group] of figure) {
      group.position.fromArray(data.xpos, 3 * body);
      const [w, x, y, z] = data.xquat.subarray(4 * body, 4 * body + 4);
      group.quaternion.set(x, y, z, w);
    }
  }

  show(figure, on) {
    for (const group of figure.values()) group.visible = on;
  }

  // Look at the robot, the camera moving with it.
  follow([x, y]) {
    const way = new THREE.Vector3(x, y, 0.75).sub(this.controls.target).multiplyScalar(0.08);
    way.z = 0;
    this.controls.target.add(way);
    this.camera.position.add(way);
    this.sun.position.set(x + 1.5, y + 1, 4);
    this.sun.target.position.set(x, y, 0.5);
  }

  draw() {
    this.controls.update();
    this.renderer.render(this.scene, this.camera);
  }

  #resize() {
    const { clientWidth, clientHeight } = this.renderer.domElement.parentElement;
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / Math.max(1, clientHeight);
    this.camera.updateProjectionMatrix();
  }
}
