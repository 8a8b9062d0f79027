// SPDX-License-Identifier: Apache-2.0
// Scene for a machine: light, ground, a camera that a person moves. Redrawn only after a change.
import {
  Box3,
  Color,
  DirectionalLight,
  GridHelper,
  HemisphereLight,
  type Object3D,
  PerspectiveCamera,
  Scene,
  Sphere,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { colour, onThemeChange } from "../../design/colours";
import { disposeMachine } from "./machine";

export type Viewpoint = "front" | "side" | "top";

const DIRECTIONS: Record<Viewpoint | "corner", [number, number, number]> = {
  corner: [1, -1.25, 0.75],
  front: [0, -1, 0.08],
  side: [1, 0, 0.08],
  top: [0, -0.001, 1],
};

export class Stage {
  readonly #place: HTMLElement;
  readonly #machine: Object3D;
  readonly #renderer: WebGLRenderer;
  readonly #scene = new Scene();
  readonly #camera = new PerspectiveCamera(35, 1, 0.01, 50);
  readonly #orbit: OrbitControls;
  readonly #resized: ResizeObserver;
  readonly #noTheme: () => void;
  #grid: GridHelper | null = null;
  #frame = 0;

  /** Throws the browser's error if the browser does not support WebGL. */
  constructor(place: HTMLElement, machine: Object3D) {
    this.#place = place;
    this.#machine = machine;
    this.#renderer = new WebGLRenderer({ antialias: true });
    this.#renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.#renderer.domElement.tabIndex = -1;
    place.append(this.#renderer.domElement);
    this.#camera.up.set(0, 0, 1);
    const sun = new DirectionalLight(0xffffff, 2.2);
    sun.position.set(1.5, -2, 3);
    this.#scene.add(new HemisphereLight(0xffffff, 0x8890a0, 1.6), sun, machine);
    this.#orbit = new OrbitControls(this.#camera, this.#renderer.domElement);
    this.#orbit.addEventListener("change", () => this.draw());
    this.#dress();
    this.#noTheme = onThemeChange(() => this.#dress());
    this.#resized = new ResizeObserver(() => this.#fit());
    this.#resized.observe(place);
    this.#fit();
    this.look("corner");
  }

  /** Requests a redraw in the next animation frame. */
  draw(): void {
    if (this.#frame) return;
    this.#frame = requestAnimationFrame(() => {
      this.#frame = 0;
      this.#renderer.render(this.#scene, this.#camera);
    });
  }

  /** Adds an object to the scene; the caller frees it. */
  add(object: Object3D): void {
    this.#scene.add(object);
    this.draw();
  }

  remove(object: Object3D): void {
    this.#scene.remove(object);
    this.draw();
  }

  look(from: Viewpoint | "corner"): void {
    const seen = new Box3().setFromObject(this.#machine);
    const sphere = seen.getBoundingSphere(new Sphere());
    if (!(sphere.radius > 0)) sphere.set(new Vector3(0, 0, 0.3), 0.7);
    const far = (sphere.radius / Math.sin((this.#camera.fov * Math.PI) / 360)) * Math.max(1, 1 / this.#camera.aspect) * 0.82;
    this.#camera.position.copy(new Vector3(...DIRECTIONS[from]).normalize().multiplyScalar(far)).add(sphere.center);
    this.#orbit.target.copy(sphere.center);
    this.#orbit.update();
    this.draw();
  }

  dispose(): void {
    cancelAnimationFrame(this.#frame);
    this.#noTheme();
    this.#resized.disconnect();
    this.#orbit.dispose();
    disposeMachine(this.#scene);
    this.#renderer.dispose();
    this.#renderer.domElement.remove();
  }

  #fit(): void {
    const { clientWidth: width, clientHeight: height } = this.#place;
    if (width === 0 || height === 0) return;
    this.#renderer.setSize(width, height);
    this.#camera.aspect = width / height;
    this.#camera.updateProjectionMatrix();
    this.draw();
  }

  #dress(): void {
    this.#scene.background = new Color(colour("--panel"));
    if (this.#grid) this.#scene.remove(this.#grid);
    this.#grid = new GridHelper(3, 12, colour("--line-strong"), colour("--line"));
    this.#grid.rotateX(Math.PI / 2);
    this.#scene.add(this.#grid);
    this.draw();
  }
}
